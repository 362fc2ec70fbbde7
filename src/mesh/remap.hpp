#pragma once

#include "mesh/hex_mesh.hpp"

#include <cassert>
#include <span>

namespace hexopt {

/// How the vertices and cells of one mesh are numbered in another one made from it.
struct Remap {
    std::vector<Index> vertex_old2new; ///< kNoIndex: left out
    std::vector<Index> cell_old2new;   ///< kNoIndex: left out
    std::size_t vertex_count = 0;      ///< of the new mesh
    std::size_t cell_count = 0;        ///< of the new mesh
};

/// Everything keeps its number.
Remap identity_remap(const HexMesh& mesh);

/// old2new of a list that names the old number of every new one; old numbers not listed are left out.
std::vector<Index> invert_order(std::span<const Index> new2old, std::size_t old_count);

/// The way back. A remap that leaves something out has none: asserts.
Remap invert(const Remap& remap);

/// First `first`, then `second`.
Remap compose(const Remap& first, const Remap& second);

/// Renumbers positions, cells, levels, hanging rows (sorted anew), boundary quads; raises the revision. Cells
/// left out take their boundary quads along where a vertex goes too. A vertex that a kept cell or hanging row
/// needs may not be left out: asserts.
HexMesh apply_remap(const HexMesh& mesh, const Remap& remap);

/// Values of the new numbering; new places that nothing maps to keep T{}.
template <class T>
std::vector<T> remap_values(std::span<const T> old_values, std::span<const Index> old2new,
                            std::size_t new_count) {
    assert(old_values.size() == old2new.size());
    std::vector<T> values(new_count);
    for (std::size_t i = 0; i < old_values.size(); ++i)
        if (old2new[i] != kNoIndex) values[old2new[i]] = old_values[i];
    return values;
}

} // namespace hexopt
