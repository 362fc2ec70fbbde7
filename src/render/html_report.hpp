#pragma once

#include "core/result.hpp"

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace hexopt {

/// A picture to embed.
struct ReportPicture {
    std::string title;
    std::string png; ///< the bytes of a PNG file
};

/// One web page that needs nothing else: figures, histograms, worst cells, stages, notes and pictures.
/// `report` is what `optimize --report` writes (quality before and after) or what `quality --json` writes
/// (one mesh); keys that are missing leave their part out. Error: bad_input if it holds no quality at all.
Result<std::string> make_html_report(const nlohmann::json& report,
                                     const std::vector<ReportPicture>& pictures);

} // namespace hexopt
