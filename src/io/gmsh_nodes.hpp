#pragma once

#include "core/types.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace hexopt::io_detail {

/// From Gmsh's node tags, any positive numbers, to vertices in the order of the file.
class GmshNodes {
  public:
    void add(std::int64_t tag) { tags_.push_back(tag); }
    std::int64_t tag(std::size_t vertex) const { return tags_[vertex]; }

    /// Prepares find(); a tag that was added twice, if there is one.
    std::optional<std::int64_t> index() {
        sorted_.reserve(tags_.size());
        for (std::size_t v = 0; v < tags_.size(); ++v) sorted_.emplace_back(tags_[v], static_cast<Index>(v));
        std::sort(sorted_.begin(), sorted_.end());
        for (std::size_t i = 1; i < sorted_.size(); ++i)
            if (sorted_[i - 1].first == sorted_[i].first) return sorted_[i].first;
        return std::nullopt;
    }

    std::optional<Index> find(std::int64_t tag) const {
        if (sorted_.empty() || tag < sorted_.front().first || tag > sorted_.back().first) return std::nullopt;
        // Tags are nearly always consecutive: then the place is known.
        const auto guess =
            static_cast<std::uint64_t>(tag) - static_cast<std::uint64_t>(sorted_.front().first);
        if (guess < sorted_.size() && sorted_[guess].first == tag) return sorted_[guess].second;
        const auto found =
            std::lower_bound(sorted_.begin(), sorted_.end(), std::pair<std::int64_t, Index>(tag, 0));
        if (found == sorted_.end() || found->first != tag) return std::nullopt;
        return found->second;
    }

  private:
    std::vector<std::int64_t> tags_;
    std::vector<std::pair<std::int64_t, Index>> sorted_;
};

} // namespace hexopt::io_detail
