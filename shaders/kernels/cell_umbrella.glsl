KERNEL_BODY(cell_umbrella) {
    store_vertex_sums(product, gid, load_edges(points, cells, gid, real(1)), edge_weight.at[gid]);
}
