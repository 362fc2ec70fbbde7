#include "pipeline/checkpoint.hpp"

#include "pipeline/archive_mesh_state.hpp"

#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr const char *kKind = "checkpoint", *kFileName = "mesh.checkpoint";

} // namespace

Result<Checkpoint> Checkpoint::start(const std::filesystem::path& folder, RunIdentity identity,
                                     const Context& context) {
    std::error_code error;
    const std::filesystem::path file = folder / kFileName;
    if (std::filesystem::exists(file, error))
        return make_error(ErrorCode::usage, "checkpoint", file.string(),
                          "is of a run that has not ended; go on with it by --resume, or remove it");
    std::filesystem::create_directories(folder, error);
    if (error)
        return make_error(ErrorCode::output_failed, "checkpoint", folder.string(),
                          "cannot be made: " + error.message());
    if (auto trial = AtomicFile::create(file, context); !trial) return trial.error();
    return Checkpoint(file, std::move(identity));
}

Result<Checkpoint> Checkpoint::resume(const std::filesystem::path& folder, RunIdentity identity,
                                      const Context& context) {
    std::error_code error;
    if (!std::filesystem::is_directory(folder, error))
        return make_error(ErrorCode::bad_input, "checkpoint", folder.string(),
                          "no such folder; without --resume it is made");
    const std::filesystem::path file = folder / kFileName;
    if (!std::filesystem::exists(file, error)) {
        context.log(LogLevel::warning,
                    folder.string() + " holds no checkpoint yet: the run begins from the start");
        return start(folder, std::move(identity), context);
    }
    auto archive = ArchiveFile::open(file, kKind, kCheckpointFormat, context);
    if (!archive) return archive.error();
    RunIdentity before;
    ArchiveReader reader = archive->reader();
    reader(before);
    if (!reader.is_sound())
        return make_error(ErrorCode::bad_input, "checkpoint", file.string(), "does not say what it is of");
    if (const std::string difference = describe_difference(before, identity); !difference.empty())
        return make_error(ErrorCode::usage, "checkpoint", file.string(),
                          fmt::format("is of another run: {}; resume with what it was begun with, or begin "
                                      "anew in another folder",
                                      difference));
    Checkpoint checkpoint(file, std::move(identity));
    checkpoint.state_ = std::move(*archive);
    return checkpoint;
}

Result<MeshState> Checkpoint::load(const Domain& domain, StageClock& clock, Context& context) {
    ArchiveReader reader = state_->reader();
    RunIdentity before;
    reader(before);
    std::vector<StageTime> times;
    auto state = read_state(reader, domain, times, context);
    state_.reset();
    if (!state) {
        Error error = state.error();
        error.stage = "checkpoint";
        error.where = file_.string();
        error.reasons.emplace_back("remove it and begin anew");
        return error;
    }
    clock.add_earlier(std::move(times));
    context.log(LogLevel::info, fmt::format("going on with {}: {}, attempt {}", file_.string(),
                                            name_of(state->phase), state->round + 1));
    return state;
}

void Checkpoint::save(const MeshState& state, const StageClock& clock, Context& context) const {
    const Status saved = ArchiveFile::write(
        file_, kKind, kCheckpointFormat,
        [&](ArchiveWriter& writer) {
            writer(identity_);
            write_state(writer, state, clock.times());
        },
        context);
    if (!saved && saved.error().code != ErrorCode::cancelled)
        context.log(LogLevel::warning, "no checkpoint was written: " + saved.error().one_line());
}

void Checkpoint::remove() const {
    std::error_code error;
    std::filesystem::remove(file_, error);
}

} // namespace hexopt
