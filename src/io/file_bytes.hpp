#pragma once

#include "core/context.hpp"
#include "core/result.hpp"

#include <filesystem>
#include <memory>
#include <string_view>

namespace hexopt {

/// A whole file in memory, read once: later changes on disk cannot invalidate what was checked.
class FileBytes {
  public:
    FileBytes(std::unique_ptr<char[]> data, std::size_t size) : data_(std::move(data)), size_(size) {}
    std::string_view view() const { return {data_.get(), size_}; }

  private:
    std::unique_ptr<char[]> data_;
    std::size_t size_;
};

/// Reads a regular file. Errors: bad_input (missing, no permission, a directory or device, empty),
/// out_of_memory, cancelled.
Result<FileBytes> read_file(const std::filesystem::path& path, const Context& context);

} // namespace hexopt
