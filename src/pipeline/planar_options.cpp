#include "pipeline/planar_options.hpp"

#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// Corners in the frame of planes across an axis.
Box box_in_plane(const Box& box, const PlaneFrame& frame) {
    return {frame.to_plane(box.low), frame.to_plane(box.high)};
}

Error turned_box(std::string stage, std::string where) {
    return Error{ErrorCode::usage,
                 std::move(stage),
                 std::move(where),
                 {"the slab's plane is turned against the model's axes, along which this is given",
                  "leave it out, or turn the model such that the plane is one of constant x, y or z"}};
}

/// Four numbers are bounds along the two axes in the plane, in the order of the axes.
Result<Box> farfield_in_plane(const Box& given, int across) {
    const int first = across == 0 ? 1 : 0, second = across == 2 ? 1 : 2;
    if (std::isfinite(given.low.z))
        return make_error(ErrorCode::usage, "planar", "--farfield",
                          fmt::format("a planar mesh needs four numbers: {0}min,{1}min,{0}max,{1}max",
                                      "xyz"[first], "xyz"[second]));
    Box box = given;
    for (const auto& [from, to] : {std::pair{&given.low, &box.low}, {&given.high, &box.high}}) {
        Point model(0);
        model[first] = from->x;
        model[second] = from->y;
        model[across] = from->z;
        *to = PlaneFrame::across(across).to_plane(model);
    }
    return box;
}

} // namespace

Result<MeshOptions> options_in_plane(const MeshOptions& options, const PlaneFrame& frame) {
    MeshOptions out = options;
    const std::optional<int> across = frame.axis();
    InitialMeshOptions& initial = out.refine.initial;
    if (!across) {
        if (out.farfield) return turned_box("planar", "--farfield");
        if (initial.box) return turned_box("refine", "box");
        if (initial.cells != std::array<Index, 3>{0, 0, 0}) return turned_box("refine", "initial cells");
    } else {
        if (out.farfield) {
            Result<Box> box = farfield_in_plane(*out.farfield, *across);
            if (!box) return box.error();
            out.farfield = *box;
        }
        if (initial.box) initial.box = box_in_plane(*initial.box, frame);
        const auto cells = initial.cells;
        initial.cells = {cells[(*across + 1) % 3], cells[(*across + 2) % 3], cells[*across]};
    }
    for (Point& seed : out.trim.seeds) seed = frame.to_plane(seed);
    out.refine.planar = true;
    out.refine.frame = frame;
    return out;
}

} // namespace hexopt
