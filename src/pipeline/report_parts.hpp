#pragma once

#include "domain/deviation.hpp"
#include "pipeline/flatten_faces.hpp"
#include "pipeline/stage_clock.hpp"
#include "stages/optimize/optimize.hpp"

#include <nlohmann/json_fwd.hpp>
#include <vector>

/// Parts that the reports of several commands have in common; keys in docs/report.md.
namespace hexopt::report {

nlohmann::json stats_json(const OptimizeStats& stats);
nlohmann::json deviation_json(const Deviation& deviation);
nlohmann::json warped_json(const FlattenReport& report);
nlohmann::json stages_json(const std::vector<StageTime>& times);
/// null where the value is not finite.
nlohmann::json finite_or_null(double value);

} // namespace hexopt::report
