#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "samples/perturb.hpp"

#include <string_view>
#include <vector>

namespace hexopt {

/// A mesh that the project generates itself, for examples, tests and benchmarks.
struct SampleInfo {
    std::string_view name;
    std::string_view description; ///< one line
    Index default_size;           ///< level-0 cells along an edge
    int default_levels;           ///< refinement levels; 0: the sample has none
};

/// What to make. The same options give the same mesh on every machine and for any number of threads.
struct SampleOptions {
    Index size = 0;         ///< level-0 cells along an edge; 0: the sample's default
    int levels = -1;        ///< deepest refinement level, 0..6; -1: the sample's default
    double tangled = 0;     ///< fraction of cells to tangle by moving inner vertices, 0..0.9
    bool scrambled = false; ///< put all inner vertices at random places instead (as "scrambled-cube" does)
    PerturbPattern pattern = PerturbPattern::everywhere;
};

/// All samples, in the order of the documentation.
const std::vector<SampleInfo>& sample_infos();
std::vector<std::string> sample_names();

/// Makes a sample; the seed and threads come from the context. Errors (usage): unknown name, options out of
/// range, a tangled fraction that the sample cannot reach; cancelled.
Result<HexMesh> make_sample(std::string_view name, const SampleOptions& options, Context& context);

} // namespace hexopt
