#pragma once

#include "io/archive.hpp"
#include "pipeline/mesh_state.hpp"
#include "pipeline/stage_clock.hpp"

namespace hexopt {

void write_state(ArchiveWriter& writer, const MeshState& state, const std::vector<StageTime>& times);

/// A state that was written for this domain; `times`: of the stages behind it. Nothing is assumed about the
/// bytes. Errors (bad_input): they hold no state, or one that does not fit the domain or itself.
Result<MeshState> read_state(ArchiveReader& reader, const Domain& domain, std::vector<StageTime>& times,
                             Context& context);

} // namespace hexopt
