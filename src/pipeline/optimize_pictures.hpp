#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "render/image.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace hexopt {

/// The mesh before (left) and after, each cut in half across y and coloured by quality. `before`: its
/// positions at the start. Error: cancelled.
Result<Image> draw_before_and_after(const HexMesh& after, const std::vector<Point>& before, Context& context);

/// A web page of the run: `report` of to_json(), and pictures of before and after from outside and cut in
/// half.
Result<std::string> make_page(const nlohmann::json& report, const HexMesh& after,
                              const std::vector<Point>& before, Context& context);

} // namespace hexopt
