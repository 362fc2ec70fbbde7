/* Meshes a cube, given as 12 triangles with a patch a side, and counts the quads of each patch. */
#include <hexopt/hexopt.h>

#include <stdio.h>

static int print_progress(void* user, const char* stage, double fraction, const char* detail) {
    (void)user;
    (void)detail;
    fprintf(stderr, "%3.0f %% %s\n", 100 * fraction, stage);
    return 0; /* anything else would cancel */
}

int main(void) {
    /* Vertex i is at (i & 1, i >> 1 & 1, i >> 2); each side is two triangles, counter-clockwise from outside.
     */
    static const uint32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    double positions[24];
    uint32_t triangles[36], patch[12];
    for (int i = 0; i < 8; ++i)
        for (int k = 0; k < 3; ++k) positions[3 * i + k] = i >> k & 1;
    for (uint32_t s = 0; s < 6; ++s)
        for (uint32_t half = 0; half < 2; ++half) {
            uint32_t* t = triangles + 3 * (2 * s + half);
            t[0] = sides[s][0], t[1] = sides[s][1 + half], t[2] = sides[s][2 + half];
            patch[2 * s + half] = 10 * s; /* any numbers */
        }

    hexopt_context_options context_options = HEXOPT_CONTEXT_OPTIONS_INIT;
    context_options.progress = print_progress;
    hexopt_context* context = NULL;
    if (hexopt_context_create(&context_options, &context) != HEXOPT_OK) return 1;

    hexopt_surface surface = HEXOPT_SURFACE_INIT;
    surface.vertex_count = 8;
    surface.positions = positions;
    surface.triangle_count = 12;
    surface.triangles = triangles;
    surface.triangle_patch = patch;
    hexopt_volume* volume = NULL;
    hexopt_mesh_result result = HEXOPT_MESH_RESULT_INIT;
    const hexopt_status status =
        hexopt_mesh_surface(context, &surface, "[refine]\ncells = 800\n", &volume, &result);
    if (status != HEXOPT_OK)
        fprintf(stderr, "%s: %s\n", hexopt_status_name(status), hexopt_context_message(context));
    if (volume) {
        const hexopt_mesh mesh = hexopt_volume_mesh(volume);
        printf("%zu cells, %zu vertices, minimum scaled Jacobian %.3f\n", mesh.cell_count, mesh.vertex_count,
               result.min_sj);
        for (uint32_t p = 0; p < hexopt_volume_patch_count(volume); ++p) {
            size_t quads = 0;
            for (size_t q = 0; q < mesh.patch_quad_count; ++q) quads += mesh.quad_patch[q] == p;
            printf("patch %s: %zu quads\n", hexopt_volume_patch_name(volume, p), quads);
        }
    }
    hexopt_volume_destroy(volume);
    hexopt_context_destroy(context);
    return (int)status;
}
