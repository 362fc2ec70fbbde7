#pragma once

#include "compute/backend.hpp"

#include <unordered_set>

namespace hexopt::compute {

/// Derives barriers from declared access: asked before each command in turn, says whether it touches what a
/// command since the last barrier wrote, or writes what one read.
class Hazards {
  public:
    /// True: put a barrier before the command.
    bool needs_barrier(const Command& command) {
        reads_now_.clear();
        writes_now_.clear();
        collect(command);
        bool hazard = false;
        for (std::uint32_t id : reads_now_) hazard = hazard || written_.contains(id);
        for (std::uint32_t id : writes_now_) hazard = hazard || written_.contains(id) || read_.contains(id);
        if (hazard) {
            written_.clear();
            read_.clear();
        }
        read_.insert(reads_now_.begin(), reads_now_.end());
        written_.insert(writes_now_.begin(), writes_now_.end());
        return hazard;
    }

  private:
    void collect(const Command& command) {
        if (command.kind != Command::Kind::dispatch) {
            writes_now_.push_back(command.target.buffer);
            if (command.kind == Command::Kind::copy) reads_now_.push_back(command.source.buffer);
            return;
        }
        for (const ArgInfo& arg : command.kernel->args) {
            if (!arg.is_buffer) continue;
            BufferRef ref;
            std::memcpy(&ref, command.args.data() + arg.offset, sizeof ref);
            if (ref.buffer == 0) continue;
            if (arg.access != Access::write) reads_now_.push_back(ref.buffer);
            if (arg.access != Access::read) writes_now_.push_back(ref.buffer);
        }
    }

    std::vector<std::uint32_t> reads_now_, writes_now_;
    std::unordered_set<std::uint32_t> read_, written_;
};

} // namespace hexopt::compute
