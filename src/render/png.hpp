#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "render/image.hpp"

#include <filesystem>
#include <string>

namespace hexopt {

/// The image as a PNG file's bytes (8 bits a channel, no alpha, zlib level 6). The same image gives the same
/// bytes with the same zlib.
std::string encode_png(const Image& image);

/// Error usage unless the name ends in .png, which is all that write_png() can write.
Status check_png_name(const std::filesystem::path& file);

/// Atomic: see AtomicFile. Error: output_failed.
Status write_png(const std::filesystem::path& file, const Image& image, const Context& context);

} // namespace hexopt
