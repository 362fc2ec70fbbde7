#pragma once

#include "core/context.hpp"
#include "io/scanner.hpp"
#include "mesh/feature_lines.hpp"

#include <span>
#include <vector>

/// One reader of feature lines a format. On false the scanner holds the error.
namespace hexopt::io_detail {

/// What a reader collects: vertices, and polylines of their numbers.
struct LineBuilder {
    std::vector<Point> vertices;
    std::vector<std::array<Index, 2>> segments;

    /// Numbers must be those of vertices by the end.
    void add_polyline(std::span<const Index> ids) {
        for (std::size_t i = 0; i + 1 < ids.size(); ++i) segments.push_back({ids[i], ids[i + 1]});
    }
};

/// read_feature_lines() of a file that is in memory already.
Result<FeatureLines> read_feature_lines_bytes(const std::string& file, std::string_view bytes,
                                              const Context& context);

bool looks_like_legacy_polydata(std::string_view bytes);
bool read_legacy_polydata_lines(Scanner& scanner, LineBuilder& builder);
bool read_vtp_lines(Scanner& scanner, LineBuilder& builder);

} // namespace hexopt::io_detail
