/* Untangles a 4 x 4 x 4 grid whose middle vertex was pulled through its neighbours, in the caller's arrays.
 */
#include <hexopt/hexopt.h>

#include <stdio.h>

enum { N = 4, V = N + 1 };

static uint32_t vertex_at(int x, int y, int z) { return (uint32_t)((z * V + y) * V + x); }

static int print_progress(void* user, const char* stage, double fraction, const char* detail) {
    (void)user;
    printf("%3.0f %% %s %s\n", 100 * fraction, stage, detail);
    return 0; /* anything else would cancel */
}

int main(void) {
    static double positions[3 * V * V * V];
    static uint32_t cells[8 * N * N * N];
    uint32_t* cell = cells;
    for (int z = 0; z < V; ++z)
        for (int y = 0; y < V; ++y)
            for (int x = 0; x < V; ++x) {
                double* p = positions + 3 * vertex_at(x, y, z);
                p[0] = x, p[1] = y, p[2] = z;
                if (x == N || y == N || z == N) continue;
                for (int k = 0; k < 8; ++k) { /* VTK order: round the bottom face, then the top one */
                    const int dx = (k & 3) == 1 || (k & 3) == 2, dy = (k & 3) >= 2, dz = k >= 4;
                    *cell++ = vertex_at(x + dx, y + dy, z + dz);
                }
            }
    positions[3 * vertex_at(2, 2, 2)] += 1.6;

    hexopt_context_options context_options = HEXOPT_CONTEXT_OPTIONS_INIT;
    context_options.progress = print_progress;
    hexopt_context* context = NULL;
    if (hexopt_context_create(&context_options, &context) != HEXOPT_OK) return 1;

    hexopt_mesh mesh = HEXOPT_MESH_INIT;
    mesh.vertex_count = V * V * V;
    mesh.positions = positions;
    mesh.cell_count = N * N * N;
    mesh.cells = cells;
    hexopt_optimize_options options = HEXOPT_OPTIMIZE_OPTIONS_INIT;
    options.boundary = HEXOPT_BOUNDARY_FIXED;
    hexopt_optimize_result result = HEXOPT_OPTIMIZE_RESULT_INIT;
    const hexopt_status status = hexopt_optimize(context, &mesh, NULL, &options, &result);
    if (status != HEXOPT_OK)
        fprintf(stderr, "%s: %s\n", hexopt_status_name(status), hexopt_context_message(context));
    else
        printf("bad cells %llu -> %llu, minimum scaled Jacobian %.3f -> %.3f\n",
               (unsigned long long)result.concave32_before, (unsigned long long)result.concave32_after,
               result.min_sj_before, result.min_sj_after);
    hexopt_context_destroy(context);
    return (int)status;
}
