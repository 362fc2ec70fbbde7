#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace hexopt {

/// A file that appears under its name whole or not at all. Bytes go into a temporary beside the target;
/// commit() flushes them to the device, reads them back, compares size and CRC-32, and renames. Until then an
/// earlier file under that name stays as it was; without a commit the temporary is removed.
///
/// A symbolic link is followed: the file it names is replaced, the link stays. The mode bits of an earlier
/// file are kept. Directories, devices and pipes are refused.
///
/// Errors are ErrorCode::output_failed with the reason (no space, no permission, no such directory, ...), or
/// ErrorCode::cancelled where the context is cancelled between create() and the rename. A context that is
/// cancelled already when create() is called does not stop the write: who writes then wants what was reached.
class AtomicFile {
  public:
    static Result<AtomicFile> create(const std::filesystem::path& target, const Context& context);

    AtomicFile(AtomicFile&& other) noexcept;
    AtomicFile& operator=(AtomicFile&&) = delete;
    ~AtomicFile();

    /// Appends bytes.
    Status write(std::string_view bytes);

    /// Makes the file durable and visible. At most once; no write() after it.
    Status commit();

    std::uint64_t size() const { return size_; } ///< bytes appended so far

  private:
    AtomicFile(std::filesystem::path target, const Context& context);
    Error failure(const char* action, int error_number) const;
    bool is_interrupted() const { return !was_cancelled_ && context_->is_cancelled(); }
    Error interruption() const;
    Status open_temporary();
    Status flush();
    Status verify();
    void discard() noexcept;

    std::filesystem::path named_;  ///< as the caller wrote it, for messages
    std::filesystem::path target_; ///< links resolved
    std::filesystem::path temporary_;
    const Context* context_;
    bool was_cancelled_;
    int descriptor_ = -1;
    std::string buffer_;
    std::uint64_t size_ = 0;
    std::uint32_t checksum_ = 0;
};

/// Writes one block of bytes as an AtomicFile.
Status write_atomically(const std::filesystem::path& target, std::string_view bytes, const Context& context);

} // namespace hexopt
