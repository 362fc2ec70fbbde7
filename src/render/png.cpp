#include "render/png.hpp"

#include "io/atomic_file.hpp"

#include <cctype>
#include <cstdlib>
#include <stdexcept>
#include <zlib.h>

namespace hexopt {

namespace {

void append_u32(std::string& bytes, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
}

void append_chunk(std::string& png, const char* type, const std::string& data) {
    append_u32(png, static_cast<std::uint32_t>(data.size()));
    const std::string checked = type + data;
    png += checked;
    append_u32(png, static_cast<std::uint32_t>(crc32(0, reinterpret_cast<const Bytef*>(checked.data()),
                                                     static_cast<uInt>(checked.size()))));
}

/// Each row as its difference from the row above ("up", filter type 2), which suits flat colours.
std::string filtered_rows(const Image& image) {
    const std::size_t stride = static_cast<std::size_t>(image.width()) * 3;
    std::string rows;
    rows.reserve((stride + 1) * static_cast<std::size_t>(image.height()));
    for (int y = 0; y < image.height(); ++y) {
        rows += static_cast<char>(2);
        const std::uint8_t* row = image.bytes().data() + static_cast<std::size_t>(y) * stride;
        for (std::size_t i = 0; i < stride; ++i)
            rows += static_cast<char>(row[i] - (y > 0 ? row[i - stride] : 0));
    }
    return rows;
}

std::string deflated(const std::string& data) {
    uLongf size = compressBound(static_cast<uLong>(data.size()));
    std::string packed(size, '\0');
    const int status =
        compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(data.data()),
                  static_cast<uLong>(data.size()), 6);
    if (status != Z_OK) throw std::bad_alloc(); // the only failure of compress2 with room for the bound
    packed.resize(size);
    return packed;
}

} // namespace

std::string encode_png(const Image& image) {
    std::string png = "\x89PNG\r\n\x1a\n";
    std::string header;
    append_u32(header, static_cast<std::uint32_t>(image.width()));
    append_u32(header, static_cast<std::uint32_t>(image.height()));
    header += {8, 2, 0, 0, 0}; // 8 bits, RGB, deflate, filters by row, not interlaced
    append_chunk(png, "IHDR", header);
    append_chunk(png, "IDAT", deflated(filtered_rows(image)));
    append_chunk(png, "IEND", "");
    return png;
}

Status check_png_name(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".png") return Done{};
    return make_error(ErrorCode::usage, "write", file.string(),
                      "pictures are written as PNG; name the file .png");
}

Status write_png(const std::filesystem::path& file, const Image& image, const Context& context) {
    return write_atomically(file, encode_png(image), context);
}

} // namespace hexopt
