// Scaled Jacobian of a corner: det of its three edges over the product of their lengths, in -1..1; 0 where an edge
// has no length.
FN real scaled_jacobian(real j, real len2_a, real len2_b, real len2_c) {
    real lengths = sqrt(len2_a) * sqrt(len2_b) * sqrt(len2_c);
    rbool degenerate = lengths == real(0);
    return sel(degenerate, real(0), divide(j, sel(degenerate, real(1), lengths)));
}
