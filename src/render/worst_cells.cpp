#include "render/worst_cells.hpp"

#include "mesh/hex_reference.hpp"
#include "quality/mesh_validity.hpp"
#include "render/camera.hpp"
#include "render/color_map.hpp"
#include "render/legend.hpp"

#include <fmt/format.h>
#include <numeric>
#include <set>

namespace hexopt {

namespace {

constexpr int kPatches = 12; ///< along each side of a face, which is a curved patch in general

constexpr double kBehindAll = -1e30;

Point bilinear(const std::array<Point, 4>& p, double s, double t) {
    return (1 - s) * (1 - t) * p[0] + s * (1 - t) * p[1] + s * t * p[2] + (1 - s) * t * p[3];
}

/// The cell's faces in small quads with smooth light, and its edges.
void add_solid_cell(Scene& scene, const HexPoints& cell, Color color, const Camera& camera, double scale,
                    float line_width) {
    for (const auto& face : hex::kFaceVertex) {
        const std::array<Point, 4> p = {cell[face[0]], cell[face[1]], cell[face[2]], cell[face[3]]};
        for (int i = 0; i < kPatches; ++i)
            for (int j = 0; j < kPatches; ++j) {
                const double s0 = i / double(kPatches), s1 = (i + 1) / double(kPatches);
                const double t0 = j / double(kPatches), t1 = (j + 1) / double(kPatches);
                const Point a = bilinear(p, s0, t0), b = bilinear(p, s1, t0), c = bilinear(p, s1, t1),
                            d = bilinear(p, s0, t1);
                ScreenQuad quad;
                quad.corner = {camera.project(a, scale), camera.project(b, scale), camera.project(c, scale),
                               camera.project(d, scale)};
                quad.fill = shade(color, glm::cross(c - a, d - b), camera.view());
                scene.quads.push_back(quad);
            }
    }
    for (const auto& edge : hex::kEdgeVertex) {
        // Lifted a little towards the viewer, so that the faces they bound do not swallow them.
        ScreenPoint from = camera.project(cell[edge[0]], scale), to = camera.project(cell[edge[1]], scale);
        from.z += line_width;
        to.z += line_width;
        scene.lines.push_back({from, to, kInk, line_width});
    }
}

std::vector<Index> neighbours_of(const HexMesh& mesh, const Topology& topology, Index cell) {
    std::set<Index> found;
    for (Index v : mesh.cells[cell])
        for (const CellCorner& corner : topology.vertex_cell[v]) found.insert(corner.cell);
    found.erase(cell);
    return {found.begin(), found.end()};
}

void add_wires(Scene& scene, const HexMesh& mesh, const std::vector<Index>& cells, const Camera& camera,
               double scale, float line_width) {
    std::set<std::pair<Index, Index>> edges;
    for (Index c : cells)
        for (const auto& edge : hex::kEdgeVertex) {
            const Index a = mesh.cells[c][edge[0]], b = mesh.cells[c][edge[1]];
            edges.insert({std::min(a, b), std::max(a, b)});
        }
    for (const auto& [a, b] : edges) {
        ScreenPoint from = camera.project(mesh.positions[a], scale);
        ScreenPoint to = camera.project(mesh.positions[b], scale);
        from.z = to.z = kBehindAll; // wires around the cell, never across it
        scene.lines.push_back({from, to, Color{0.72f, 0.75f, 0.79f}, line_width});
    }
}

std::vector<Index> worst_of(const std::vector<CellValidity>& cells, std::size_t count) {
    std::vector<Index> order(cells.size());
    std::iota(order.begin(), order.end(), Index{0});
    count = std::min(count, order.size());
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
                      [&](Index a, Index b) {
                          return is_worse(cells[a], cells[b]) || (!is_worse(cells[b], cells[a]) && a < b);
                      });
    order.resize(count);
    return order;
}

void draw_panel(Image& image, Rectangle panel, int text_scale, const HexMesh& mesh, const Topology& topology,
                Index number, const CellValidity& quality, const View& view, const Parallel& parallel) {
    const int caption = (kGlyphHeight + 4) * text_scale;
    const Rectangle area{panel.x + text_scale, panel.y + caption, panel.width - 2 * text_scale,
                         panel.height - caption - text_scale};
    const HexPoints cell = cell_points(mesh, number);
    Camera camera(view, area);
    Point middle(0);
    for (const Point& p : cell) middle += p / 8.0;
    // Room around the cell, for its neighbours to show.
    for (const Point& p : cell) camera.include(middle + 1.5 * (p - middle));
    const double scale = camera.scale();
    const auto line_width = static_cast<float>(text_scale);
    Scene scene;
    add_solid_cell(scene, cell, quality.is_usable() ? quality_color(quality.scaled_jacobian) : kBadColor,
                   camera, scale, 1.5f * line_width);
    add_wires(scene, mesh, neighbours_of(mesh, topology, number), camera, scale, 0.8f * line_width);
    rasterise(scene, area, image, parallel);
    const std::string text =
        fmt::format("{}: sj {:.3f} bad {}+{} {}", number, quality.scaled_jacobian, quality.concave8,
                    quality.concave24, quality.validity == Validity::valid ? "" : name_of(quality.validity));
    image.write(panel.x + 2 * text_scale, panel.y + 2 * text_scale, text_scale, kInk,
                text.substr(0, static_cast<std::size_t>(panel.width / (kGlyphWidth * text_scale))));
}

} // namespace

Image render_worst_cells(const HexMesh& mesh, const Topology& topology, const RenderOptions& options,
                         Context& context) {
    const Parallel& parallel = context.parallel();
    const std::vector<CellValidity> cells = compute_cell_validities(mesh, parallel);
    const std::vector<Index> worst = worst_of(cells, options.worst_count);
    Image image(options.size.width, options.size.height, kBackground);
    const Layout layout = lay_out(options.size, true);
    write_caption(image, layout, quality_caption(count_validity(cells, parallel)));
    draw_quality_legend(image, layout);

    int columns = 1;
    while (columns * columns < static_cast<int>(worst.size())) ++columns;
    const int rows = (static_cast<int>(worst.size()) + columns - 1) / columns;
    const int width = layout.model.width / columns, height = layout.model.height / rows;
    const int text_scale = std::max(1, std::min(layout.text_scale, width / (30 * kGlyphWidth)));
    for (std::size_t i = 0; i < worst.size() && !context.is_cancelled(); ++i) {
        const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
        const Rectangle panel{layout.model.x + column * width, layout.model.y + row * height, width, height};
        if (column > 0) image.fill(panel.x - 1, panel.y, 1, height, Color{0.85f, 0.86f, 0.88f});
        if (row > 0) image.fill(panel.x, panel.y - 1, width, 1, Color{0.85f, 0.86f, 0.88f});
        draw_panel(image, panel, text_scale, mesh, topology, worst[i], cells[worst[i]], options.view,
                   parallel);
    }
    return image;
}

} // namespace hexopt
