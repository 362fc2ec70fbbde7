#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "render/image.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hexopt {

/// The mesh from outside (left) and cut in half across y (right), coloured by quality. Error: cancelled.
Result<Image> draw_whole_and_cut(const HexMesh& mesh, Context& context);

/// A web page of the run: `report` of to_json(), and pictures from outside, by patch, cut in half and of the
/// worst cells. Error: cancelled.
Result<std::string> make_mesh_page(const nlohmann::json& report, const HexMesh& mesh, Context& context);

} // namespace hexopt
