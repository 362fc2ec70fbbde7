#pragma once

#include "core/context.hpp"
#include "io/archive.hpp"
#include "io/file_bytes.hpp"

#include <filesystem>
#include <functional>

namespace hexopt {

/// State of a program for the same program on the same kind of machine: a line that says what it is, the
/// format's number, the order of bytes, an archive, and the CRC-32 of all that.
class ArchiveFile {
  public:
    /// Writes what body() hands to the writer, as an AtomicFile. kind: a word for the first line. Errors:
    /// those of AtomicFile.
    static Status write(const std::filesystem::path& path, std::string_view kind, std::uint32_t format,
                        const std::function<void(ArchiveWriter&)>& body, const Context& context);

    /// Errors: those of read_file(); bad_input where the file is of another kind or format, cut short or
    /// damaged.
    static Result<ArchiveFile> open(const std::filesystem::path& path, std::string_view kind,
                                    std::uint32_t format, const Context& context);

    ArchiveReader reader() const { return ArchiveReader(bytes_.view().substr(begin_, end_ - begin_)); }

  private:
    ArchiveFile(FileBytes bytes, std::size_t begin, std::size_t end)
        : bytes_(std::move(bytes)), begin_(begin), end_(end) {}

    FileBytes bytes_;
    std::size_t begin_, end_;
};

} // namespace hexopt
