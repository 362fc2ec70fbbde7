#include "pipeline/mesh_pictures.hpp"

#include "mesh/topology.hpp"
#include "render/html_report.hpp"
#include "render/outer_box.hpp"
#include "render/png.hpp"
#include "render/render_mesh.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

constexpr PictureSize kHalf = {1000, 750};

RenderOptions outside_view() {
    RenderOptions options;
    options.size = kHalf;
    return options;
}

/// The surface, of a flow in a box that of the body.
RenderOptions surface_view(const HexMesh& mesh, const Topology& topology) {
    RenderOptions options = outside_view();
    options.without_box = has_outer_box(mesh, topology);
    return options;
}

Result<Image> draw_cut(const HexMesh& mesh, const Topology& topology, Context& context) {
    RenderOptions options = outside_view();
    options.clips.push_back({.axis = 1, .fraction = 0.5, .keep_above = true});
    Result<Image> image = render_mesh(mesh, topology, options, context);
    if (image || image.error().code != ErrorCode::usage) return image;
    return render_mesh(mesh, topology, outside_view(), context); // nothing lies beyond the cut
}

void paste(const Image& source, int left, Image& target) {
    for (int y = 0; y < source.height(); ++y)
        for (int x = 0; x < source.width(); ++x) target.set(left + x, y, source.get(x, y));
}

} // namespace

Result<Image> draw_whole_and_cut(const HexMesh& mesh, Context& context) {
    const Topology topology = compute_topology(mesh, context.parallel());
    const Result<Image> whole = render_mesh(mesh, topology, surface_view(mesh, topology), context);
    if (!whole) return whole;
    const Result<Image> cut = draw_cut(mesh, topology, context);
    if (!cut) return cut;
    Image picture(2 * kHalf.width, kHalf.height, {1, 1, 1});
    paste(*whole, 0, picture);
    paste(*cut, kHalf.width, picture);
    return picture;
}

Result<std::string> make_mesh_page(const nlohmann::json& report, const HexMesh& mesh, Context& context) {
    const Topology topology = compute_topology(mesh, context.parallel());
    const RenderOptions surface = surface_view(mesh, topology);
    RenderOptions patches = surface, worst = outside_view();
    patches.color = ColorBy::patch;
    worst.worst_count = 4;
    std::vector<ReportPicture> pictures;
    std::vector<std::pair<std::string, RenderOptions>> views = {{"from outside", outside_view()}};
    if (surface.without_box) views.emplace_back("without the outer box", surface);
    views.emplace_back("patches", patches);
    views.emplace_back("worst cells", worst);
    for (const auto& [title, options] : views) {
        const Result<Image> image = render_mesh(mesh, topology, options, context);
        if (!image) return image.error();
        pictures.push_back({title, encode_png(*image)});
    }
    const Result<Image> cut = draw_cut(mesh, topology, context);
    if (!cut) return cut.error();
    pictures.push_back({"cut in half", encode_png(*cut)});
    return make_html_report(report, pictures);
}

} // namespace hexopt
