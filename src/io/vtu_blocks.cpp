#include "io/vtu_blocks.hpp"

#include "io/scalar.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <limits>
#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

namespace hexopt::io_detail {

namespace {

constexpr const char* kAdvice = "the file is damaged or cut short; write or copy it again";

Error damaged(std::string reason) {
    return Error{ErrorCode::bad_input, "read", "", {std::move(reason), kAdvice}};
}

/// The most that a compressed byte can stand for: limits of the formats of zlib (1032) and LZ4 (255); for
/// LZMA what a run of one byte reaches, rounded up.
constexpr std::uint64_t most_expansion(Compressor compressor) {
    switch (compressor) {
    case Compressor::zlib:
        return 1040;
    case Compressor::lz4:
        return 256;
    case Compressor::lzma:
        return 10000;
    case Compressor::none:
        break;
    }
    return 1;
}

bool inflate_zlib(std::string_view packed, char* out, std::size_t size) {
    uLongf written = size;
    return uncompress(reinterpret_cast<Bytef*>(out), &written, reinterpret_cast<const Bytef*>(packed.data()),
                      packed.size()) == Z_OK &&
           written == size;
}

bool inflate_lz4(std::string_view packed, char* out, std::size_t size) {
    constexpr std::size_t kMost = std::numeric_limits<int>::max();
    if (packed.size() > kMost || size > kMost) return false;
    return LZ4_decompress_safe(packed.data(), out, static_cast<int>(packed.size()), static_cast<int>(size)) ==
           static_cast<int>(size);
}

bool inflate_lzma(std::string_view packed, char* out, std::size_t size) {
    std::uint64_t memory_limit = std::uint64_t{128} << 20; // the strongest preset needs 65 MiB
    std::size_t in_position = 0, out_position = 0;
    return lzma_stream_buffer_decode(
               &memory_limit, 0, nullptr, reinterpret_cast<const std::uint8_t*>(packed.data()), &in_position,
               packed.size(), reinterpret_cast<std::uint8_t*>(out), &out_position, size) == LZMA_OK &&
           out_position == size;
}

bool inflate(Compressor compressor, std::string_view packed, char* out, std::size_t size) {
    switch (compressor) {
    case Compressor::zlib:
        return inflate_zlib(packed, out, size);
    case Compressor::lz4:
        return inflate_lz4(packed, out, size);
    case Compressor::lzma:
        return inflate_lzma(packed, out, size);
    case Compressor::none:
        break;
    }
    return false;
}

class HeaderReader {
  public:
    HeaderReader(std::string_view bytes, const BlockLayout& layout) : bytes_(bytes), layout_(layout) {}
    std::size_t width() const { return layout_.has_wide_headers ? 8 : 4; }
    std::size_t numbers_left() const { return bytes_.size() / width(); }
    /// Only where numbers_left() > 0.
    std::uint64_t next() {
        const std::uint64_t value = layout_.has_wide_headers
                                        ? load<std::uint64_t>(bytes_.data(), layout_.order)
                                        : load<std::uint32_t>(bytes_.data(), layout_.order);
        bytes_.remove_prefix(width());
        return value;
    }
    std::string_view rest() const { return bytes_; }

  private:
    std::string_view bytes_;
    const BlockLayout& layout_;
};

Status check_size(std::uint64_t size, std::optional<std::uint64_t> expected) {
    if (expected && size != *expected)
        return damaged(fmt::format("an array of {} bytes where {} are needed", size, *expected));
    return Done{};
}

Result<Block> decode_plain(HeaderReader header, std::optional<std::uint64_t> expected) {
    if (header.numbers_left() < 1) return damaged("the data end where an array should start");
    const std::uint64_t size = header.next();
    if (Status status = check_size(size, expected); !status) return status.error();
    if (size > header.rest().size())
        return damaged(fmt::format("an array announces {} bytes, but {} follow", size, header.rest().size()));
    return Block{std::string(header.rest().substr(0, size)), header.width() + size};
}

Result<Block> decode_compressed(HeaderReader header, const BlockLayout& layout,
                                std::optional<std::uint64_t> expected) {
    const std::size_t whole = header.rest().size();
    if (header.numbers_left() < 1) return damaged("the data end where an array should start");
    const std::uint64_t count = header.next();
    if (count > header.numbers_left() || count + 2 > header.numbers_left()) {
        // Some writers store an empty array as a single zero.
        if (count == 0 && expected.value_or(0) == 0) return Block{{}, header.width()};
        return damaged(
            fmt::format("an array announces {} compressed blocks, more than the file can hold", count));
    }
    const std::uint64_t block_size = header.next(), last_size = header.next();
    std::uint64_t packed_size = 0;
    std::vector<std::uint64_t> packed_sizes(count);
    for (std::uint64_t& size : packed_sizes) {
        size = header.next();
        if (size > header.rest().size()) return damaged(fmt::format("a compressed block of {} bytes", size));
        packed_size += size;
    }
    std::string_view packed = header.rest();
    if (packed_size > packed.size())
        return damaged(
            fmt::format("compressed blocks of {} bytes, but {} follow", packed_size, packed.size()));
    const std::uint64_t most = packed_size * most_expansion(layout.compressor) + 64;
    const auto too_large = [&] {
        return damaged(
            fmt::format("{} compressed bytes cannot hold {} blocks of {}", packed_size, count, block_size));
    };
    if (last_size > block_size || (count > 1 && block_size > most / (count - 1))) return too_large();
    const std::uint64_t last = last_size == 0 ? block_size : last_size;
    const std::uint64_t size = count == 0 ? 0 : (count - 1) * block_size + last;
    if (size > most) return too_large();
    if (Status status = check_size(size, expected); !status) return status.error();
    Block block{std::string(size, '\0'), whole - packed.size() + packed_size};
    for (std::uint64_t b = 0, out = 0; b < count; ++b) {
        const std::uint64_t part = b + 1 == count ? last : block_size;
        if (!inflate(layout.compressor, packed.substr(0, packed_sizes[b]), block.content.data() + out, part))
            return damaged(fmt::format("compressed block {} cannot be unpacked", b));
        packed.remove_prefix(packed_sizes[b]);
        out += part;
    }
    return block;
}

constexpr std::array<std::int8_t, 256> kBase64Digit = [] {
    std::array<std::int8_t, 256> digit{};
    for (auto& d : digit) d = -1;
    constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < kAlphabet.size(); ++i)
        digit[static_cast<unsigned char>(kAlphabet[i])] = static_cast<std::int8_t>(i);
    return digit;
}();

} // namespace

Result<Block> decode_block(std::string_view bytes, const BlockLayout& layout,
                           std::optional<std::uint64_t> expected_size) {
    const HeaderReader header(bytes, layout);
    return layout.compressor == Compressor::none ? decode_plain(header, expected_size)
                                                 : decode_compressed(header, layout, expected_size);
}

std::optional<std::string> decode_base64(std::string_view text) {
    std::string out;
    out.reserve(text.size() / 4 * 3);
    std::uint32_t group = 0;
    int digits = 0, padding = 0;
    for (char c : text) {
        if (c == ' ' || (c >= '\t' && c <= '\r')) continue;
        const int digit = kBase64Digit[static_cast<unsigned char>(c)];
        if (c == '=' && digits >= 2)
            ++padding;
        else if (digit < 0 || padding > 0)
            return std::nullopt;
        group = group << 6 | static_cast<std::uint32_t>(std::max(digit, 0));
        if (++digits < 4) continue;
        for (int k = 0; k < 3 - padding; ++k) out += static_cast<char>(group >> (16 - 8 * k) & 0xFF);
        group = 0;
        digits = padding = 0;
    }
    if (digits != 0) return std::nullopt;
    return out;
}

} // namespace hexopt::io_detail
