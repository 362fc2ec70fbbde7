#include "domain/surface_pieces.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

using Triangle = std::array<Index, 3>;

struct EdgeUse {
    std::array<Index, 2> edge; ///< smaller vertex first
    Index triangle;
    std::uint8_t side;    ///< edge side..side+1 of the triangle
    std::uint8_t forward; ///< 1 where the triangle runs from the smaller vertex to the larger
    auto operator<=>(const EdgeUse&) const = default;
};

std::vector<EdgeUse> collect_uses(std::span<const Triangle> triangles) {
    std::vector<EdgeUse> uses;
    uses.reserve(3 * triangles.size());
    for (Index t = 0; t < triangles.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const Index a = triangles[t][k], b = triangles[t][(k + 1) % 3];
            uses.push_back({{std::min(a, b), std::max(a, b)}, t, k, a < b});
        }
    std::sort(uses.begin(), uses.end());
    return uses;
}

/// Calls visit(uses of one edge) for every edge.
template <class Visit>
void for_each_edge(std::span<const EdgeUse> uses, const Visit& visit) {
    for (std::size_t i = 0; i < uses.size();) {
        std::size_t end = i + 1;
        while (end < uses.size() && uses[end].edge == uses[i].edge) ++end;
        visit(uses.subspan(i, end - i));
        i = end;
    }
}

Triangle sorted(Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
}

bool is_even(const Triangle& t) {
    return (t[0] < t[1] && t[1] < t[2]) || (t[1] < t[2] && t[2] < t[0]) || (t[2] < t[0] && t[0] < t[1]);
}

Index find_root(std::vector<Index>& parent, Index i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/// Numbers the sets of a union-find by their first member.
Index number_sets(std::vector<Index>& parent) {
    std::vector<Index> number(parent.size(), kNoIndex);
    std::vector<Index> of(parent.size());
    Index count = 0;
    for (Index i = 0; i < parent.size(); ++i) {
        Index& n = number[find_root(parent, i)];
        if (n == kNoIndex) n = count++;
        of[i] = n;
    }
    parent = std::move(of);
    return count;
}

struct Mate {
    Index triangle = kNoIndex;
    std::uint8_t same_direction = 0;
};
using Mates = std::vector<std::array<Mate, 3>>;

Mates find_mates(std::size_t count, std::span<const EdgeUse> uses) {
    Mates mates(count);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        const std::uint8_t same = edge[0].forward == edge[1].forward;
        mates[edge[0].triangle][edge[0].side] = {edge[1].triangle, same};
        mates[edge[1].triangle][edge[1].side] = {edge[0].triangle, same};
    });
    return mates;
}

/// Pieces by flood fill; the members of a piece agree in direction with its first triangle.
void fill_pieces(const Mates& mates, SurfacePieces& pieces) {
    pieces.piece.assign(mates.size(), kNoIndex);
    pieces.flipped.assign(mates.size(), 0);
    std::vector<Index> stack;
    for (Index seed = 0; seed < mates.size(); ++seed) {
        if (pieces.piece[seed] != kNoIndex) continue;
        pieces.piece[seed] = pieces.piece_count;
        stack.push_back(seed);
        while (!stack.empty()) {
            const Index t = stack.back();
            stack.pop_back();
            for (const Mate& mate : mates[t]) {
                if (mate.triangle == kNoIndex) continue;
                const std::uint8_t flip = pieces.flipped[t] ^ mate.same_direction;
                if (pieces.piece[mate.triangle] == kNoIndex) {
                    pieces.piece[mate.triangle] = pieces.piece_count;
                    pieces.flipped[mate.triangle] = flip;
                    stack.push_back(mate.triangle);
                } else if (pieces.flipped[mate.triangle] != flip && mate.triangle > t) {
                    ++pieces.unorientable_edges;
                }
            }
        }
        ++pieces.piece_count;
    }
}

void keep_majority(std::span<const Point> vertices, SurfacePieces& pieces) {
    std::vector<double> balance(pieces.piece_count, 0); // area as given less area turned over
    for (Index t = 0; t < pieces.triangles.size(); ++t) {
        const Triangle& v = pieces.triangles[t];
        const Point& x = vertices[v[0]];
        const double area = glm::length(glm::cross(vertices[v[1]] - x, vertices[v[2]] - x));
        balance[pieces.piece[t]] += pieces.flipped[t] ? -area : area;
    }
    for (Index t = 0; t < pieces.triangles.size(); ++t) {
        pieces.flipped[t] ^= balance[pieces.piece[t]] < 0;
        if (pieces.flipped[t]) std::swap(pieces.triangles[t][1], pieces.triangles[t][2]);
    }
}

void join_clusters(SurfacePieces& pieces) {
    const std::vector<EdgeUse> uses = collect_uses(pieces.triangles);
    pieces.cluster.resize(pieces.piece_count);
    std::iota(pieces.cluster.begin(), pieces.cluster.end(), Index{0});
    std::vector<std::uint8_t> open(pieces.piece_count, 0);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        int balance = 0;
        const Index first = pieces.piece[edge[0].triangle];
        for (const EdgeUse& use : edge) {
            balance += use.forward ? 1 : -1;
            const Index a = find_root(pieces.cluster, first),
                        b = find_root(pieces.cluster, pieces.piece[use.triangle]);
            pieces.cluster[std::max(a, b)] = std::min(a, b);
        }
        if (balance != 0) open[first] = 1;
    });
    pieces.cluster_count = number_sets(pieces.cluster);
    pieces.closed.assign(pieces.cluster_count, 1);
    for (Index p = 0; p < pieces.piece_count; ++p)
        if (open[p]) pieces.closed[pieces.cluster[p]] = 0;
}

} // namespace

std::vector<Index> drop_repeated(std::span<const Triangle> triangles) {
    std::vector<Index> order;
    for (Index t = 0; t < triangles.size(); ++t) {
        const Triangle& v = triangles[t];
        if (v[0] != v[1] && v[1] != v[2] && v[2] != v[0]) order.push_back(t);
    }
    std::sort(order.begin(), order.end(), [&](Index a, Index b) {
        const Triangle x = sorted(triangles[a]), y = sorted(triangles[b]);
        return x != y ? x < y : a < b;
    });
    std::vector<Index> single;
    std::vector<std::array<Index, 2>> pairs; // of opposite triangles
    for (std::size_t i = 0; i < order.size();) {
        std::size_t end = i + 1;
        Index other = kNoIndex;
        const Triangle key = sorted(triangles[order[i]]);
        for (; end < order.size() && sorted(triangles[order[end]]) == key; ++end)
            if (other == kNoIndex && is_even(triangles[order[end]]) != is_even(triangles[order[i]]))
                other = order[end];
        if (other == kNoIndex)
            single.push_back(order[i]);
        else
            pairs.push_back({order[i], other});
        i = end;
    }
    // One of a pair is needed where the triangles beside it are odd in number.
    std::vector<Triangle> all;
    for (Index t : single) all.push_back(triangles[t]);
    for (const auto& pair : pairs) all.insert(all.end(), {triangles[pair[0]], triangles[pair[1]]});
    std::vector<std::uint8_t> odd(all.size(), 0);
    for_each_edge(collect_uses(all), [&](std::span<const EdgeUse> edge) {
        for (const EdgeUse& use : edge) odd[use.triangle] += edge.size() % 2;
    });
    const std::size_t first_pair = single.size();
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (odd[first_pair + 2 * i] >= 2) single.push_back(pairs[i][0]);
    std::sort(single.begin(), single.end());
    return single;
}

SurfacePieces find_pieces(std::vector<Triangle> triangles, std::span<const Point> vertices) {
    SurfacePieces pieces;
    pieces.triangles = std::move(triangles);
    const std::vector<EdgeUse> uses = collect_uses(pieces.triangles);
    fill_pieces(find_mates(pieces.triangles.size(), uses), pieces);
    keep_majority(vertices, pieces);
    join_clusters(pieces);
    return pieces;
}

} // namespace hexopt
