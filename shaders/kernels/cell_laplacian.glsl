KERNEL_BODY(cell_laplacian) {
    store_vertex_sums(product, gid, load_field(field, cells, gid, real(1)), edge_weight.at[gid]);
}
