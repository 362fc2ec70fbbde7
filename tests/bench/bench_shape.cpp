/// Shapes a mesh from a surface, everything before the optimizer: bench_shape SURFACE [cells [gap_levels]]
/// Prints what each stage made of the number of cells, one line, and the stages' CPU seconds with one thread.
#include "io/read_surface.hpp"
#include "pipeline/mesh_surface.hpp"

#include <cstdio>
#include <cstdlib>

using namespace hexopt;

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    Context context(1);
    const auto soup = read_surface(argv[1], context);
    if (!soup) return std::fprintf(stderr, "%s\n", soup.error().one_line().c_str()), 3;
    MeshOptions options;
    options.refine.target_cells = argc > 2 ? std::atof(argv[2]) : 50e3;
    if (argc > 3) options.refine.gap_levels = std::atoi(argv[3]);
    context.set_log_sink([](LogLevel, std::string_view text) {
        std::printf("  %.*s\n", static_cast<int>(text.size()), text.data());
    });
    context.set_progress_sink([&](std::string_view stage, double, std::string_view) {
        if (stage == "optimize") context.cancel();
    });
    StageClock clock;
    const auto outcome = mesh_surface(*soup, options, clock, context);
    for (const StageTime& time : clock.times()) std::printf("%s %.2f  ", time.stage.c_str(), time.cpu_seconds);
    if (!outcome) return std::printf("\n%s\n", outcome.error().one_line().c_str()), 3;
    const TrimReport& trim = outcome->trim;
    const std::size_t final_cells = outcome->mesh.cell_count();
    const std::size_t quads = outcome->buffer ? outcome->buffer->before.surface_quads : 0;
    std::printf(
        "\nsize %.4g octree %zu kept %zu quads %zu final %zu ratio %.2f (kept + %.2f quads) rounds %d + %d "
        "volume %.3f bare %.4f\n",
        outcome->refine.surface_size, trim.octree_cells, trim.kept_cells, quads, final_cells,
        static_cast<double>(final_cells) / options.refine.target_cells,
        quads ? (static_cast<double>(final_cells) - static_cast<double>(trim.kept_cells)) /
                    static_cast<double>(quads)
              : 0,
        outcome->trim_rounds, outcome->fit_rounds, trim.kept_volume / trim.enclosed_volume,
        trim.bare_area / trim.surface_area);
    for (const std::string& note : outcome->notes) std::printf("  %s\n", note.c_str());
    return 0;
}
