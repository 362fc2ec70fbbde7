#include "mesh/face_split.hpp"

#include "core/random.hpp"

#include <algorithm>
#include <bit>

namespace hexopt {

namespace {

Quad sorted_key(Quad quad) {
    std::sort(quad.begin(), quad.end());
    return quad;
}

std::uint64_t hash_of(const Quad& key) {
    const std::uint64_t low = std::uint64_t{key[1]} << 32 | key[0];
    const std::uint64_t high = std::uint64_t{key[3]} << 32 | key[2];
    return mix_bits(low ^ mix_bits(high));
}

/// True if b walks round the same vertices as a the other way.
bool is_reversed(const Quad& a, const Quad& b) {
    const auto at = std::find(b.begin(), b.end(), a[0]) - b.begin();
    return at < 4 && a[1] == b[(at + 3) % 4] && a[2] == b[(at + 2) % 4] && a[3] == b[(at + 1) % 4];
}

struct Part {
    Quad quad;
    double u0, u1, v0, v1;
};

class CoverSearch {
  public:
    CoverSearch(const FaceSplitter& splitter, const MidpointFinder& finder, int max_cuts, FaceCover& cover)
        : splitter_(splitter), finder_(finder), max_cuts_(max_cuts), cover_(cover) {}

    bool search(const Part& part, int cuts) {
        if (cuts > 0)
            if (const Index face = splitter_.find_opposite(part.quad); face != kNoIndex) {
                cover_.parts.push_back(face);
                return true;
            }
        return cuts < max_cuts_ && (search_cut(part, cuts, false) || search_cut(part, cuts, true));
    }

  private:
    bool search_cut(const Part& part, int cuts, bool along_v) {
        const Quad& q = part.quad;
        std::vector<Index> lower, upper;
        finder_(q[0], along_v ? q[3] : q[1], lower);
        if (lower.empty()) return false;
        finder_(along_v ? q[1] : q[3], q[2], upper);
        for (Index m : lower)
            for (Index n : upper)
                if (try_cut(part, cuts, along_v, m, n)) return true;
        return false;
    }

    bool try_cut(const Part& part, int cuts, bool along_v, Index m, Index n) {
        const std::size_t parts = cover_.parts.size(), vertices = cover_.vertices.size();
        const Quad& q = part.quad;
        Part first = part, second = part;
        if (along_v) {
            const double v = (part.v0 + part.v1) / 2;
            cover_.vertices.insert(cover_.vertices.end(), {{m, part.u0, v}, {n, part.u1, v}});
            first.quad = {q[0], q[1], n, m};
            second.quad = {m, n, q[2], q[3]};
            first.v1 = second.v0 = v;
        } else {
            const double u = (part.u0 + part.u1) / 2;
            cover_.vertices.insert(cover_.vertices.end(), {{m, u, part.v0}, {n, u, part.v1}});
            first.quad = {q[0], m, n, q[3]};
            second.quad = {m, q[1], q[2], n};
            first.u1 = second.u0 = u;
        }
        if (search(first, cuts + 1) && search(second, cuts + 1)) return true;
        cover_.parts.resize(parts);
        cover_.vertices.resize(vertices);
        return false;
    }

    const FaceSplitter& splitter_;
    const MidpointFinder& finder_;
    int max_cuts_;
    FaceCover& cover_;
};

} // namespace

FaceSplitter::FaceSplitter(std::vector<Quad> faces) : quads_(std::move(faces)) {
    keys_.reserve(quads_.size());
    for (const Quad& quad : quads_) keys_.push_back(sorted_key(quad));
    table_.assign(std::bit_ceil(std::max<std::size_t>(4, 2 * quads_.size())), kNoIndex);
    for (Index face = 0; face < quads_.size(); ++face) {
        std::size_t slot = hash_of(keys_[face]) & (table_.size() - 1);
        while (table_[slot] != kNoIndex) slot = (slot + 1) & (table_.size() - 1);
        table_[slot] = face;
    }
}

Index FaceSplitter::find_opposite(const Quad& quad) const {
    const Quad key = sorted_key(quad);
    for (std::size_t slot = hash_of(key) & (table_.size() - 1); table_[slot] != kNoIndex;
         slot = (slot + 1) & (table_.size() - 1))
        if (keys_[table_[slot]] == key && is_reversed(quad, quads_[table_[slot]])) return table_[slot];
    return kNoIndex;
}

bool FaceSplitter::cover(Index face, const MidpointFinder& finder, int max_cuts, FaceCover& cover) const {
    cover.parts.clear();
    cover.vertices.clear();
    return CoverSearch(*this, finder, max_cuts, cover).search({quads_[face], 0, 1, 0, 1}, 0);
}

} // namespace hexopt
