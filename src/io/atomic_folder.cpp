#include "io/atomic_folder.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

namespace hexopt {

namespace {

namespace fs = std::filesystem;

/// 0, or the errno of the failure. Some file systems cannot flush a directory and say EINVAL.
int flush_folder(const fs::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return errno;
    const int code = ::fsync(descriptor) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : errno;
    ::close(descriptor);
    return code;
}

fs::path parent_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

Error refusal(const fs::path& target, std::string reason, std::string advice) {
    return Error{ErrorCode::output_failed, "write", target.string(), {std::move(reason), std::move(advice)}};
}

} // namespace

Error AtomicFolder::failure(const char* action, int error_number) const {
    return refusal(named_,
                   fmt::format("cannot {}: {}", action, std::generic_category().message(error_number)),
                   "the earlier folder, if any, is unchanged");
}

Status AtomicFolder::check(const fs::path& target, const std::set<std::string>& replaceable) {
    std::error_code error;
    const fs::file_status earlier = fs::status(target, error);
    if (fs::exists(earlier) && !fs::is_directory(earlier))
        return refusal(target, "is a file, not a folder", "name a folder");
    if (!fs::is_directory(earlier)) return Done{};
    for (const fs::directory_entry& entry : fs::directory_iterator(target, error))
        if (!replaceable.contains(entry.path().filename().string()))
            return refusal(target,
                           fmt::format("holds '{}', which would be lost", entry.path().filename().string()),
                           "move it away, or write somewhere else");
    return Done{};
}

Result<AtomicFolder> AtomicFolder::create(const fs::path& target, const std::set<std::string>& replaceable,
                                          const Context& context) {
    if (Status free = check(target, replaceable); !free) return free.error();
    AtomicFolder folder;
    std::error_code error;
    folder.named_ = target;
    folder.target_ = fs::is_symlink(target, error) ? fs::weakly_canonical(target, error) : target;
    folder.context_ = &context;
    folder.was_cancelled_ = context.is_cancelled();
    static std::atomic<unsigned> serial{0};
    folder.temporary_ =
        parent_of(folder.target_) /
        fmt::format(".{}.{}-{}.tmp", folder.target_.filename().string(), ::getpid(), serial++);
    if (::mkdir(folder.temporary_.c_str(), 0777) != 0) {
        const int error_number = errno;
        folder.temporary_.clear();
        return folder.failure("create a temporary folder beside it", error_number);
    }
    return folder;
}

AtomicFolder::AtomicFolder(AtomicFolder&& other) noexcept
    : named_(std::move(other.named_)), target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)), context_(other.context_),
      was_cancelled_(other.was_cancelled_) {
    other.temporary_.clear();
}

AtomicFolder::~AtomicFolder() {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

/// Afterwards temporary_ is the earlier folder, or empty where there was none.
Status AtomicFolder::exchange() {
    const char *from = temporary_.c_str(), *to = target_.c_str();
    std::error_code error;
    if (!fs::exists(target_, error)) {
        if (::rename(from, to) != 0) return failure("rename the temporary folder", errno);
        temporary_.clear();
        return Done{};
    }
    if (::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_EXCHANGE) == 0) return Done{};
    if (errno != EINVAL && errno != ENOSYS) return failure("exchange it with the temporary folder", errno);
    // This file system cannot exchange: two steps, the first undone where the second fails.
    const fs::path aside = temporary_.string() + ".earlier";
    if (::rename(to, aside.c_str()) != 0) return failure("move the earlier folder aside", errno);
    if (::rename(from, to) != 0) {
        const int error_number = errno;
        ::rename(aside.c_str(), to);
        return failure("rename the temporary folder", error_number);
    }
    temporary_ = aside;
    return Done{};
}

Status AtomicFolder::commit() {
    if (!was_cancelled_ && context_->is_cancelled())
        return Error{ErrorCode::cancelled,
                     "write",
                     named_.string(),
                     {"cancelled while writing", "the earlier folder, if any, is unchanged"}};
    if (const int code = flush_folder(temporary_); code != 0) return failure("flush it to the disk", code);
    if (Status status = exchange(); !status) return status;
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
    temporary_.clear();
    if (const int code = flush_folder(parent_of(target_)); code != 0)
        return failure("flush the directory to the disk", code);
    return Done{};
}

} // namespace hexopt
