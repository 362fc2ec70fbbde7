#pragma once

#include "io/archive_file.hpp"
#include "pipeline/mesh_state.hpp"
#include "pipeline/run_identity.hpp"
#include "pipeline/stage_clock.hpp"

#include <filesystem>

namespace hexopt {

/// Of what a checkpoint stores; raised with every change of that.
constexpr std::uint32_t kCheckpointFormat = 8;

/// Where a run keeps its state between stages: one file in a folder, replaced at once.
class Checkpoint {
  public:
    /// Makes the folder where there is none. Errors: output_failed (it cannot be made or written to); usage
    /// where it holds the state of an earlier run.
    static Result<Checkpoint> start(const std::filesystem::path& folder, RunIdentity identity,
                                    const Context& context);
    /// Goes on with what the folder holds, from the beginning where it holds no state yet. Errors: bad_input
    /// (no such folder; a file that is no checkpoint, cut short or damaged); usage where it is of another
    /// program, input or options.
    static Result<Checkpoint> resume(const std::filesystem::path& folder, RunIdentity identity,
                                     const Context& context);

    /// Whether there is a state to go on with.
    bool has_state() const { return state_.has_value(); }
    /// That state, once. `clock` gets the times of the stages behind it. Error (bad_input): the file's bytes
    /// are no state of a run on this domain.
    Result<MeshState> load(const Domain& domain, StageClock& clock, Context& context);

    /// Replaces the state on disk. Where that fails the run is worth more than its checkpoint: a warning.
    void save(const MeshState& state, const StageClock& clock, Context& context) const;
    /// Removes it: the run has written what it was to write.
    void remove() const;

  private:
    Checkpoint(std::filesystem::path file, RunIdentity identity)
        : file_(std::move(file)), identity_(std::move(identity)) {}

    std::filesystem::path file_;
    RunIdentity identity_;
    std::optional<ArchiveFile> state_;
};

/// Where the state between stages is kept, if anywhere.
struct Saving {
    const Checkpoint* checkpoint;
    const StageClock& clock;
    Context& context;

    void save(const MeshState& state) const {
        if (checkpoint) checkpoint->save(state, clock, context);
    }
};

} // namespace hexopt
