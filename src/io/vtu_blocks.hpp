#pragma once

#include "core/result.hpp"

#include <bit>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hexopt::io_detail {

enum class Compressor : std::uint8_t { none, zlib, lz4, lzma };

/// How a VTU file stores its binary arrays.
struct BlockLayout {
    Compressor compressor = Compressor::none;
    bool has_wide_headers = false; ///< 64-bit sizes, else 32-bit
    std::endian order = std::endian::little;
};

/// What of `bytes` an array takes, headers included, and its content.
struct Block {
    std::string content;
    std::size_t size = 0; ///< bytes taken
};

/// Decodes the array at the start of `bytes`. expected_size: bytes of the array where they are known; another
/// size is an error. Nothing larger than the compressed bytes can really hold is allocated. The error's
/// `where` is empty.
Result<Block> decode_block(std::string_view bytes, const BlockLayout& layout,
                           std::optional<std::uint64_t> expected_size);

/// Base64 without regard to white space; padding may stand between groups of four. Ends at the first other
/// character, which must be the end of `text`; nothing where it is not.
std::optional<std::string> decode_base64(std::string_view text);

} // namespace hexopt::io_detail
