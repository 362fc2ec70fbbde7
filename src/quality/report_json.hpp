#pragma once

#include "quality/mesh_quality.hpp"

#include <nlohmann/json_fwd.hpp>

namespace hexopt {

/// The report as JSON (keys: docs/quality.md); figures that are not finite become null.
nlohmann::json to_json(const QualityReport& report);

} // namespace hexopt
