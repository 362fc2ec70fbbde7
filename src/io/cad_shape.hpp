#pragma once

#include "io/cad_format.hpp"
#include "io/pack_cad.hpp"

#include <NCollection_DataMap.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS_Shape.hxx>
#include <functional>

/// What the readers of CAD files share that know OpenCASCADE.
namespace hexopt::io_detail {

using Colour = std::optional<std::array<double, 3>>;

/// What a file says of a face beside its geometry.
struct FaceLabel {
    std::string name;
    Colour colour;
    bool own_colour = false; ///< not the solid's
};
using FaceLabels = NCollection_DataMap<TopoDS_Shape, FaceLabel, TopTools_ShapeMapHasher>;

struct CadShape {
    TopoDS_Shape shape; ///< with its triangles
    FaceLabels labels;  ///< by face without its location
    double diagonal = 0;
};

/// Reads and tessellates; may throw what OpenCASCADE throws. Same bytes and options, same triangles.
Status load_cad_shape(CadFormat format, const std::string& file, std::string_view bytes,
                      const TessellationOptions& options, CadShape& cad);

/// Runs work in a process of its own and hands over what it puts into the outcome; logs its warnings. What
/// OpenCASCADE throws there, and its error, are errors here. Errors also: usage (options out of range),
/// bad_input as check_cad() and run_apart().
Result<CadOutcome> work_on_cad_apart(CadFormat format, const std::string& file, std::string_view bytes,
                                     const TessellationOptions& options, const Context& context,
                                     const std::function<void(CadOutcome&)>& work);

} // namespace hexopt::io_detail
