#include "render/render_mesh.hpp"

#include "quality/mesh_validity.hpp"
#include "render/camera.hpp"
#include "render/color_map.hpp"
#include "render/legend.hpp"
#include "render/outer_box.hpp"
#include "render/visible_faces.hpp"
#include "render/worst_cells.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unordered_map>

namespace hexopt {

namespace {

Error unusable(const std::string& reason) { return make_error(ErrorCode::usage, "render", "", reason); }

std::vector<std::uint8_t> cells_to_keep(const HexMesh& mesh, const std::vector<Clip>& clips,
                                        const Parallel& parallel) {
    if (clips.empty()) return {};
    const Bounds box = bounds_of(mesh);
    std::vector<std::uint8_t> keep(mesh.cell_count());
    parallel.for_each(keep.size(), 4096, [&](std::size_t c) {
        Point centre(0);
        for (Index v : mesh.cells[c]) centre += mesh.positions[v] / 8.0;
        keep[c] = std::all_of(clips.begin(), clips.end(), [&](const Clip& clip) {
            const double low = box.low[clip.axis], high = box.high[clip.axis];
            const double plane = low + clip.fraction * (high - low);
            return clip.keep_above ? centre[clip.axis] >= plane : centre[clip.axis] <= plane;
        });
    });
    return keep;
}

struct QuadHash {
    std::size_t operator()(const Quad& q) const {
        std::size_t hash = 0;
        for (Index v : q) hash = hash * 0x9e3779b97f4a7c15u + v;
        return hash;
    }
};

using PatchOfQuad = std::unordered_map<Quad, Index, QuadHash>;

bool shows_surface_only(const RenderOptions& options) {
    return options.without_box || !options.patches.empty();
}

Quad sorted(Quad quad) {
    std::sort(quad.begin(), quad.end());
    return quad;
}

PatchOfQuad find_patches(const HexMesh& mesh) {
    PatchOfQuad patches;
    for (const BoundaryQuad& quad : mesh.boundary) patches.emplace(sorted(quad.vertices), quad.patch);
    return patches;
}

/// Leaves the boundary faces that options choose.
void choose_surface(std::vector<VisibleFace>& faces, const HexMesh& mesh, const Topology& topology,
                    const RenderOptions& options) {
    std::erase_if(faces, [](const VisibleFace& f) { return f.is_cut; });
    if (options.without_box) {
        const std::vector<std::uint8_t> on_box = find_faces_on_box(mesh, topology);
        std::vector<CellFace> left_out;
        for (std::size_t i = 0; i < on_box.size(); ++i)
            if (on_box[i]) left_out.push_back(topology.boundary_faces[i]);
        std::sort(left_out.begin(), left_out.end());
        std::erase_if(faces, [&](const VisibleFace& f) {
            return std::binary_search(left_out.begin(), left_out.end(), f.face);
        });
    }
    if (options.patches.empty()) return;
    const PatchOfQuad patches = find_patches(mesh);
    std::vector<std::uint8_t> is_shown(mesh.patch_names.size(), 0);
    for (std::size_t p = 0; p < is_shown.size(); ++p)
        is_shown[p] = std::find(options.patches.begin(), options.patches.end(), mesh.patch_names[p]) !=
                      options.patches.end();
    std::erase_if(faces, [&](const VisibleFace& f) {
        const auto found = patches.find(sorted(face_vertices(mesh, f.face)));
        return found == patches.end() || !is_shown[found->second];
    });
}

/// Colours of faces, with the legend that explains them.
class Painter {
  public:
    Painter(const HexMesh& mesh, ColorBy by, const Parallel& parallel) : mesh_(&mesh), by_(by) {
        if (by == ColorBy::quality) cells_ = compute_cell_validities(mesh, parallel);
        if (by == ColorBy::level && !mesh.level.empty())
            deepest_ = *std::max_element(mesh.level.begin(), mesh.level.end());
        if (by == ColorBy::patch) patch_ = find_patches(mesh);
    }

    Color color_of(const VisibleFace& visible) const {
        const Index cell = visible.face.cell;
        switch (by_) {
        case ColorBy::quality:
            return cells_[cell].is_usable() ? quality_color(cells_[cell].scaled_jacobian) : kBadColor;
        case ColorBy::level:
            return level_color(mesh_->level[cell], deepest_);
        case ColorBy::patch: {
            if (visible.is_cut) return kCutColor;
            const auto found = patch_.find(sorted(face_vertices(*mesh_, visible.face)));
            return found == patch_.end() ? kBoundaryColor : patch_color(found->second);
        }
        case ColorBy::none:
            break;
        }
        return visible.is_cut ? kCutColor : kBoundaryColor;
    }

    void explain(Image& image, const Layout& layout, std::vector<std::string> caption,
                 const Parallel& parallel) const {
        std::vector<LegendEntry> entries;
        if (by_ == ColorBy::quality) {
            caption = quality_caption(count_validity(cells_, parallel));
            draw_quality_legend(image, layout);
        } else if (by_ == ColorBy::level) {
            for (int level = 0; level <= deepest_; ++level)
                entries.push_back({level_color(level, deepest_), std::to_string(level)});
            draw_swatches(image, layout, "level", entries);
        } else if (by_ == ColorBy::patch) {
            for (std::size_t p = 0; p < mesh_->patch_names.size(); ++p)
                entries.push_back({patch_color(p), mesh_->patch_names[p]});
            draw_swatches(image, layout, "patch", entries);
        }
        write_caption(image, layout, caption);
    }

  private:
    const HexMesh* mesh_;
    ColorBy by_;
    std::vector<CellValidity> cells_;
    int deepest_ = 0;
    PatchOfQuad patch_;
};

/// both_sides: faces seen from behind are lit as from the front.
Scene make_scene(const HexMesh& mesh, const std::vector<VisibleFace>& faces, const Painter& painter,
                 const Camera& camera, float line_width, bool both_sides, const Parallel& parallel) {
    const double scale = camera.scale();
    Scene scene;
    scene.quads.resize(faces.size());
    parallel.for_each(faces.size(), 4096, [&](std::size_t i) {
        const Quad vertices = face_vertices(mesh, faces[i].face);
        std::array<Point, 4> p;
        for (int k = 0; k < 4; ++k) p[k] = mesh.positions[vertices[k]];
        ScreenQuad& quad = scene.quads[i];
        double perimeter = 0;
        for (int k = 0; k < 4; ++k) quad.corner[k] = camera.project(p[k], scale);
        for (int k = 0; k < 4; ++k) perimeter += glm::length(p[(k + 1) % 4] - p[k]) * scale;
        Point normal = glm::cross(p[2] - p[0], p[3] - p[1]);
        if (both_sides && glm::dot(normal, camera.view().toward) < 0) normal = -normal;
        quad.fill = shade(painter.color_of(faces[i]), normal, camera.view());
        quad.edge_opacity = edge_opacity(perimeter / 4);
        quad.edge_width = line_width;
    });
    return scene;
}

Status check_options(const HexMesh& mesh, const RenderOptions& options) {
    if (mesh.cells.empty()) return unusable("the mesh has no cells");
    if (options.worst_count > 100) return unusable("at most 100 of the worst cells fit on a picture");
    if (options.worst_count > 0 && shows_surface_only(options))
        return unusable("close-ups of the worst cells show cells, not chosen surfaces");
    if (options.color == ColorBy::level && mesh.level.empty())
        return unusable("the mesh has no refinement levels to colour by");
    if (options.color == ColorBy::patch && mesh.boundary.empty())
        return unusable("the mesh names no patches to colour by");
    for (const std::string& name : options.patches)
        if (std::find(mesh.patch_names.begin(), mesh.patch_names.end(), name) == mesh.patch_names.end())
            return unusable(fmt::format(
                "the mesh has no patch '{}'; it has {}", name,
                mesh.patch_names.empty() ? "none" : fmt::format("{}", fmt::join(mesh.patch_names, ", "))));
    return Done{};
}

} // namespace

Result<Image> render_mesh(const HexMesh& mesh, const Topology& topology, const RenderOptions& options,
                          Context& context) {
    if (const Status status = check_options(mesh, options); !status) return status.error();
    const Parallel& parallel = context.parallel();
    if (options.worst_count > 0) return render_worst_cells(mesh, topology, options, context);

    const std::vector<std::uint8_t> keep = cells_to_keep(mesh, options.clips, parallel);
    std::vector<VisibleFace> faces = find_visible_faces(mesh, topology, keep, parallel);
    if (faces.empty()) return unusable("the clips leave no cells");
    const bool surface_only = shows_surface_only(options);
    if (surface_only) choose_surface(faces, mesh, topology, options);
    if (faces.empty()) return unusable("no boundary faces are left to draw");

    const Layout layout = lay_out(options.size, options.color != ColorBy::none);
    Camera camera(options.view, layout.model);
    for (const VisibleFace& visible : faces)
        for (Index v : face_vertices(mesh, visible.face)) camera.include(mesh.positions[v]);
    const Painter painter(mesh, options.color, parallel);
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "render", "", "cancelled");

    Image image(options.size.width, options.size.height, kBackground);
    const auto line_width = 0.7f * static_cast<float>(layout.text_scale);
    rasterise(make_scene(mesh, faces, painter, camera, line_width, surface_only, parallel), layout.model,
              image, parallel);
    draw_axes(image, layout, options.view, parallel);
    painter.explain(image, layout,
                    {fmt::format("{} cells, {} vertices", mesh.cell_count(), mesh.vertex_count())}, parallel);
    return image;
}

} // namespace hexopt
