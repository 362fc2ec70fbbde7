#include "io/atomic_file.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fcntl.h>
#include <fmt/format.h>
#include <memory>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <zlib.h>

namespace hexopt {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
constexpr const char* kStage = "write";

std::filesystem::path follow_links(std::filesystem::path path) {
    constexpr int kMostLinks = 40; // as the kernel
    std::error_code error;
    for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(path, error); ++i) {
        const std::filesystem::path to = std::filesystem::read_symlink(path, error);
        if (error) break;
        path = to.is_absolute() ? to : path.parent_path() / to;
    }
    return path;
}

std::filesystem::path directory_of(const std::filesystem::path& path) {
    return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

std::string advice_for(int error_number) {
    switch (error_number) {
    case ENOSPC:
    case EDQUOT:
        return "free some space or write to another disk";
    case EACCES:
    case EPERM:
    case EROFS:
        return "choose a directory that you may write to";
    case ENOENT:
    case ENOTDIR:
        return "create the directory first";
    case ENAMETOOLONG:
        return "choose a shorter name";
    default:
        return "the earlier file, if any, is unchanged";
    }
}

std::uint32_t extend_checksum(std::uint32_t checksum, std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(checksum, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

/// 0, or the errno of the failure.
int write_fully(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return count < 0 ? errno : EIO;
        bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return 0;
}

} // namespace

AtomicFile::AtomicFile(std::filesystem::path target, const Context& context)
    : named_(std::move(target)), target_(follow_links(named_)), context_(&context),
      was_cancelled_(context.is_cancelled()) {}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : named_(std::move(other.named_)), target_(std::move(other.target_)),
      temporary_(std::move(other.temporary_)), context_(other.context_), was_cancelled_(other.was_cancelled_),
      descriptor_(std::exchange(other.descriptor_, -1)), buffer_(std::move(other.buffer_)),
      size_(other.size_), checksum_(other.checksum_) {
    other.temporary_.clear();
}

AtomicFile::~AtomicFile() { discard(); }

void AtomicFile::discard() noexcept {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
    if (!temporary_.empty()) ::unlink(temporary_.c_str());
    temporary_.clear();
}

Error AtomicFile::failure(const char* action, int error_number) const {
    return Error{ErrorCode::output_failed,
                 kStage,
                 named_.string(),
                 {fmt::format("cannot {}: {}", action, std::generic_category().message(error_number)),
                  advice_for(error_number)}};
}

Error AtomicFile::interruption() const {
    return Error{ErrorCode::cancelled,
                 kStage,
                 named_.string(),
                 {"cancelled while writing", "the earlier file, if any, is unchanged"}};
}

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& target, const Context& context) {
    AtomicFile file(target, context);
    if (Status status = file.open_temporary(); !status) return status.error();
    file.buffer_.reserve(kBufferBytes);
    return file;
}

Status AtomicFile::open_temporary() {
    if (!target_.has_filename()) return failure("write a file of this name", EISDIR);
    struct stat earlier {};
    const bool exists = ::stat(target_.c_str(), &earlier) == 0;
    if (!exists && errno != ENOENT) return failure("write", errno);
    if (exists && S_ISDIR(earlier.st_mode)) return failure("replace a directory by a file", EISDIR);
    if (exists && !S_ISREG(earlier.st_mode))
        return Error{ErrorCode::output_failed,
                     kStage,
                     named_.string(),
                     {"not a regular file, so it cannot be replaced as a whole", "name a regular file"}};

    static std::atomic<unsigned> serial{0};
    constexpr int kAttempts = 100;
    constexpr std::size_t kLongestStem = 200; // leaves room below the usual 255 bytes of a name
    const std::string stem = target_.filename().string().substr(0, kLongestStem);
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        temporary_ = directory_of(target_) / fmt::format(".{}.{}-{}.tmp", stem, ::getpid(), serial++);
        descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor_ >= 0 || errno != EEXIST) break;
    }
    if (descriptor_ < 0) {
        const int error_number = errno;
        temporary_.clear();
        return failure("create a temporary file beside it", error_number);
    }
    if (exists && ::fchmod(descriptor_, earlier.st_mode & 07777) != 0)
        return failure("take over the mode of the earlier file", errno);
    return Done{};
}

Status AtomicFile::write(std::string_view bytes) {
    if (is_interrupted()) return interruption();
    size_ += bytes.size();
    while (!bytes.empty()) {
        const std::size_t count = std::min(bytes.size(), kBufferBytes - buffer_.size());
        buffer_.append(bytes.substr(0, count));
        bytes.remove_prefix(count);
        if (buffer_.size() < kBufferBytes) continue;
        if (Status status = flush(); !status) return status;
    }
    return Done{};
}

Status AtomicFile::flush() {
    if (is_interrupted()) return interruption();
    checksum_ = extend_checksum(checksum_, buffer_);
    const int error_number = write_fully(descriptor_, buffer_);
    buffer_.clear();
    if (error_number != 0) return failure("write", error_number);
    return Done{};
}

Status AtomicFile::verify() {
    const auto block = std::make_unique_for_overwrite<char[]>(kBufferBytes);
    std::uint64_t size = 0;
    std::uint32_t checksum = 0;
    for (;;) {
        if (is_interrupted()) return interruption();
        const ssize_t count = ::pread(descriptor_, block.get(), kBufferBytes, static_cast<off_t>(size));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) return failure("read back what was written", errno);
        if (count == 0) break;
        checksum = extend_checksum(checksum, {block.get(), static_cast<std::size_t>(count)});
        size += static_cast<std::uint64_t>(count);
    }
    if (size == size_ && checksum == checksum_) return Done{};
    return Error{ErrorCode::output_failed,
                 kStage,
                 named_.string(),
                 {fmt::format("read back {} bytes with checksum {:08x}, but wrote {} with {:08x}", size,
                              checksum, size_, checksum_),
                  "write to another disk"}};
}

Status AtomicFile::commit() {
    if (Status status = flush(); !status) return status;
    if (::fsync(descriptor_) != 0) return failure("flush to the disk", errno);
    // The pages are clean now: dropping them makes the check below read the device where it can.
    ::posix_fadvise(descriptor_, 0, 0, POSIX_FADV_DONTNEED);
    if (Status status = verify(); !status) return status;
    if (::close(std::exchange(descriptor_, -1)) != 0) return failure("close", errno);
    if (::rename(temporary_.c_str(), target_.c_str()) != 0)
        return failure("rename the temporary file", errno);
    temporary_.clear();
    // The rename is visible already; some file systems cannot flush a directory and say EINVAL.
    const int directory = ::open(directory_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory < 0) return Done{};
    const bool flushed = ::fsync(directory) == 0 || errno == EINVAL || errno == ENOTSUP;
    const int error_number = errno;
    ::close(directory);
    if (!flushed) return failure("flush the directory to the disk", error_number);
    return Done{};
}

Status write_atomically(const std::filesystem::path& target, std::string_view bytes, const Context& context) {
    Result<AtomicFile> file = AtomicFile::create(target, context);
    if (!file) return file.error();
    if (Status status = file->write(bytes); !status) return status;
    return file->commit();
}

} // namespace hexopt
