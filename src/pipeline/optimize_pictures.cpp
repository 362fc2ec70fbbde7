#include "pipeline/optimize_pictures.hpp"

#include "mesh/topology.hpp"
#include "render/html_report.hpp"
#include "render/png.hpp"
#include "render/render_mesh.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

constexpr PictureSize kHalf = {1000, 750};

Result<Image> draw_cut(const HexMesh& mesh, const Topology& topology, Context& context) {
    RenderOptions options;
    options.size = kHalf;
    options.clips.push_back({.axis = 1, .fraction = 0.5, .keep_above = true});
    Result<Image> image = render_mesh(mesh, topology, options, context);
    if (image || image.error().code != ErrorCode::usage) return image;
    options.clips.clear(); // nothing lies beyond the cut: a mesh of one cell
    return render_mesh(mesh, topology, options, context);
}

void paste(const Image& source, int left, Image& target) {
    for (int y = 0; y < source.height(); ++y)
        for (int x = 0; x < source.width(); ++x) target.set(left + x, y, source.get(x, y));
}

} // namespace

Result<Image> draw_before_and_after(const HexMesh& after, const std::vector<Point>& before,
                                    Context& context) {
    const Topology topology = compute_topology(after, context.parallel());
    HexMesh start = after;
    start.positions = before;
    Image picture(2 * kHalf.width, kHalf.height, {1, 1, 1});
    int left = 0;
    for (const HexMesh* mesh : std::initializer_list<const HexMesh*>{&start, &after}) {
        const Result<Image> half = draw_cut(*mesh, topology, context);
        if (!half) return half.error();
        paste(*half, left, picture);
        left += kHalf.width;
    }
    return picture;
}

Result<std::string> make_page(const nlohmann::json& report, const HexMesh& after,
                              const std::vector<Point>& before, Context& context) {
    const Topology topology = compute_topology(after, context.parallel());
    HexMesh start = after;
    start.positions = before;
    std::vector<ReportPicture> pictures;
    const std::pair<const HexMesh*, std::string> states[] = {{&start, "before"}, {&after, "after"}};
    for (const auto& [mesh, title] : states) {
        RenderOptions outside;
        outside.size = kHalf;
        const Result<Image> whole = render_mesh(*mesh, topology, outside, context);
        if (!whole) return whole.error();
        pictures.push_back({title, encode_png(*whole)});
        const Result<Image> cut = draw_cut(*mesh, topology, context);
        if (!cut) return cut.error();
        pictures.push_back({title + ", cut in half", encode_png(*cut)});
    }
    return make_html_report(report, pictures);
}

} // namespace hexopt
