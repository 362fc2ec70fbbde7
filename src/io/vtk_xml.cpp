#include "io/vtk_xml.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace hexopt::io_detail {

namespace {

constexpr std::pair<std::string_view, XmlSection> kSections[] = {
    {"FieldData", XmlSection::field_data}, {"PointData", XmlSection::point_data},
    {"CellData", XmlSection::cell_data},   {"Points", XmlSection::points},
    {"Cells", XmlSection::cells},          {"Verts", XmlSection::verts},
    {"Lines", XmlSection::lines},          {"Polys", XmlSection::polys},
    {"Strips", XmlSection::strips}};

constexpr std::pair<std::string_view, Scalar> kScalars[] = {
    {"Int8", Scalar::int8},       {"UInt8", Scalar::uint8},   {"Int16", Scalar::int16},
    {"UInt16", Scalar::uint16},   {"Int32", Scalar::int32},   {"UInt32", Scalar::uint32},
    {"Int64", Scalar::int64},     {"UInt64", Scalar::uint64}, {"Float32", Scalar::float32},
    {"Float64", Scalar::float64}, {"String", Scalar::int8}};

} // namespace

bool VtkXmlReader::read_number(const XmlTag& tag, const char* attribute, std::size_t& value,
                               std::optional<std::size_t> fallback) {
    const std::string* text = tag.find(attribute);
    if (text == nullptr && fallback) return value = *fallback, true;
    if (text == nullptr)
        return scanner_.fail_at(tag.begin, fmt::format("{} without {}", shown(tag.name), attribute),
                                kDamagedFile);
    std::string_view digits = *text;
    while (digits.starts_with(' ')) digits.remove_prefix(1);
    while (digits.ends_with(' ')) digits.remove_suffix(1);
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (code != std::errc() || end != digits.data() + digits.size())
        return scanner_.fail_at(tag.begin, fmt::format("{}=\"{}\" is no count", attribute, shown(*text)),
                                kDamagedFile);
    return true;
}

bool VtkXmlReader::read_file_tag(const XmlTag& tag) {
    const auto value = [&](const char* attribute, const char* fallback) {
        const std::string* text = tag.find(attribute);
        return text != nullptr ? *text : std::string(fallback);
    };
    const auto refuse = [&](const char* attribute, const std::string& text, const std::string& advice) {
        return scanner_.fail_at(tag.begin, fmt::format("{} '{}' is not supported", attribute, shown(text)),
                                advice);
    };
    has_file_tag_ = true;
    if (const std::string type = value("type", ""); type != grid_)
        return refuse("type", type,
                      type == "P" + grid_ ? "give the files that it names, one by one"
                                          : "give a file of the type " + grid_);
    const std::string order = value("byte_order", "LittleEndian");
    if (order != "LittleEndian" && order != "BigEndian") return refuse("byte_order", order, kDamagedFile);
    layout_.order = order == "BigEndian" ? std::endian::big : std::endian::little;
    const std::string header = value("header_type", "UInt32");
    if (header != "UInt32" && header != "UInt64") return refuse("header_type", header, kDamagedFile);
    layout_.has_wide_headers = header == "UInt64";
    const std::string compressor = value("compressor", "");
    if (compressor == "vtkZLibDataCompressor")
        layout_.compressor = Compressor::zlib;
    else if (compressor == "vtkLZ4DataCompressor")
        layout_.compressor = Compressor::lz4;
    else if (compressor == "vtkLZMADataCompressor")
        layout_.compressor = Compressor::lzma;
    else if (!compressor.empty())
        return refuse("compressor", compressor, "write the file with zlib, LZ4, LZMA or uncompressed");
    return true;
}

bool VtkXmlReader::read_piece_tag(const XmlTag& tag) {
    if (!tag.is_start || tag.is_end) is_in_piece_ = false;
    if (!tag.is_start) return true;
    XmlPiece piece;
    piece.begin = tag.begin;
    const bool has_cells = grid_ == "UnstructuredGrid";
    if (!read_number(tag, "NumberOfPoints", piece.points) ||
        !(has_cells ? read_number(tag, "NumberOfCells", piece.cells)
                    : read_number(tag, "NumberOfVerts", piece.verts, 0) &&
                          read_number(tag, "NumberOfLines", piece.lines, 0) &&
                          read_number(tag, "NumberOfPolys", piece.polys, 0) &&
                          read_number(tag, "NumberOfStrips", piece.strips, 0)))
        return false;
    const std::size_t most = std::max({piece.cells, piece.verts, piece.lines, piece.polys, piece.strips});
    if (piece.points >= kNoIndex || most >= kNoIndex)
        return scanner_.fail_at(tag.begin,
                                fmt::format("a piece of {} points and {} cells", piece.points, most),
                                "the file is damaged or too large; split the mesh");
    is_in_piece_ = !tag.is_end;
    pieces_.push_back(piece);
    return true;
}

bool VtkXmlReader::read_array_tag(const XmlTag& tag) {
    constexpr std::size_t kMostComponents = 1u << 20;
    if (!tag.is_start || section_ == XmlSection::none) return true;
    if (section_ != XmlSection::field_data && !is_in_piece_) return true;
    XmlArray array;
    array.section = section_;
    array.piece = pieces_.empty() ? 0 : pieces_.size() - 1;
    array.begin = tag.begin;
    array.text_begin = tag.end;
    array.text_end =
        tag.is_end ? tag.end : std::min(scanner_.bytes().find('<', tag.end), scanner_.bytes().size());
    if (const std::string* name = tag.find("Name")) array.name = *name;
    const std::string* type = tag.find("type");
    const auto known = std::find_if(std::begin(kScalars), std::end(kScalars), [&](const auto& entry) {
        return type != nullptr && entry.first == *type;
    });
    if (known == std::end(kScalars))
        return fail(array, fmt::format("type '{}' is not known", type ? shown(*type) : ""));
    array.scalar = known->second;
    array.is_string = *type == "String";
    std::size_t components = 1;
    if (!read_number(tag, "NumberOfComponents", components, 1)) return false;
    if (components > kMostComponents) return fail(array, fmt::format("{} components", components));
    array.components = static_cast<std::uint32_t>(std::max<std::size_t>(components, 1));
    const std::string* format = tag.find("format");
    if (format == nullptr || *format == "ascii")
        array.format = XmlFormat::ascii;
    else if (*format == "binary")
        array.format = XmlFormat::binary;
    else if (*format == "appended")
        array.format = XmlFormat::appended;
    else
        return fail(array, fmt::format("format '{}' is not known", shown(*format)));
    if (array.format == XmlFormat::appended && !read_number(tag, "offset", array.offset)) return false;
    arrays_.push_back(std::move(array));
    return true;
}

bool VtkXmlReader::start_appended(const XmlTag& tag) {
    const std::string* encoding = tag.find("encoding");
    const std::string text = encoding == nullptr ? "base64" : *encoding;
    if (text != "raw" && text != "base64")
        return scanner_.fail_at(tag.begin, fmt::format("encoding '{}' is not known", shown(text)),
                                kDamagedFile);
    appended_is_raw_ = text == "raw";
    const std::size_t mark = scanner_.bytes().find_first_not_of(" \t\r\n", tag.end);
    if (mark == std::string_view::npos || scanner_.bytes()[mark] != '_')
        return scanner_.fail_at(tag.end, "appended data do not start with _", kDamagedFile);
    appended_begin_ = mark + 1;
    return true;
}

bool VtkXmlReader::read_tag(const XmlTag& tag) {
    if (tag.name == "VTKFile") return !tag.is_start || read_file_tag(tag);
    if (tag.name == grid_) return has_grid_tag_ = true;
    if (tag.name == "Piece") return read_piece_tag(tag);
    if (tag.name == "DataArray" || tag.name == "Array") return read_array_tag(tag);
    if (tag.name == "AppendedData") return !tag.is_start || start_appended(tag);
    for (const auto& [name, section] : kSections)
        if (tag.name == name) section_ = tag.is_start && !tag.is_end ? section : XmlSection::none;
    return true;
}

bool VtkXmlReader::read_tags() {
    XmlTag tag;
    while (!appended_begin_ && next_tag(scanner_, tag)) {
        if (!has_file_tag_ && tag.name != "VTKFile")
            return scanner_.fail_at(tag.begin, "no VTKFile element", kDamagedFile);
        if (!read_tag(tag)) return false;
        if (tag.name == "VTKFile" && !tag.is_start) break;
    }
    if (!scanner_.ok()) return false;
    const bool is_whole = appended_begin_ || (tag.name == "VTKFile" && !tag.is_start);
    if (!has_file_tag_ || !has_grid_tag_ || pieces_.empty() || !is_whole)
        return scanner_.fail_at(scanner_.bytes().size(), "the file ends without its grid", kDamagedFile);
    for (const XmlArray& array : arrays_) {
        if (array.format != XmlFormat::appended) continue;
        if (!appended_begin_) return fail(array, "its appended data are missing");
        offsets_.push_back(array.offset);
    }
    std::sort(offsets_.begin(), offsets_.end());
    return true;
}

const XmlArray* VtkXmlReader::find_array(XmlSection section, std::size_t piece, std::string_view name) const {
    const auto found = std::find_if(arrays_.begin(), arrays_.end(), [&](const XmlArray& a) {
        return a.section == section && a.piece == piece && (name.empty() || a.name == name);
    });
    return found == arrays_.end() ? nullptr : &*found;
}

/// The appended bytes of an array: for base64, which must be decoded whole, up to the next array.
std::string_view VtkXmlReader::appended_slice(const XmlArray& array) const {
    const std::string_view all = scanner_.bytes().substr(*appended_begin_);
    if (array.offset >= all.size()) return {};
    const auto next = std::upper_bound(offsets_.begin(), offsets_.end(), array.offset);
    const bool is_last = next == offsets_.end();
    if (appended_is_raw_) return all.substr(array.offset);
    const std::size_t end =
        is_last ? std::min(all.find('<', array.offset), all.size()) : std::min(*next, all.size());
    return all.substr(array.offset, end - array.offset);
}

bool VtkXmlReader::decode(const XmlArray& array, std::optional<std::size_t> count, std::string& content) {
    std::string decoded;
    std::string_view bytes;
    if (array.format == XmlFormat::appended && appended_is_raw_) {
        bytes = appended_slice(array);
    } else {
        const std::string_view text =
            array.format == XmlFormat::appended
                ? appended_slice(array)
                : scanner_.bytes().substr(array.text_begin, array.text_end - array.text_begin);
        appended_used_ += array.format == XmlFormat::appended ? text.size() : 0;
        std::optional<std::string> plain = decode_base64(text);
        if (!plain) return fail(array, "its data are no base64");
        decoded = std::move(*plain);
        bytes = decoded;
    }
    std::optional<std::uint64_t> size;
    if (count && !array.is_string) size = std::uint64_t{*count} * size_of(array.scalar);
    Result<Block> block = decode_block(bytes, layout_, size);
    if (!block) return fail(array, block.error().reasons[0], block.error().reasons.back());
    if (block->content.size() % size_of(array.scalar) != 0)
        return fail(array, "its size is no multiple of its type's");
    if (array.format == XmlFormat::appended && appended_is_raw_) appended_used_ += block->size;
    if (appended_used_ > scanner_.bytes().size()) return fail(array, "appended arrays overlap");
    content = std::move(block->content);
    return true;
}

/// Whole numbers of [0, limit).
bool VtkXmlReader::read_integers(const XmlArray& array, std::optional<std::size_t> count, std::int64_t limit,
                                 std::vector<std::int64_t>& out) {
    if (!is_integer(array.scalar)) return fail(array, "its type is no integer");
    std::optional<std::size_t> first_bad;
    const auto use = [&](std::size_t i, auto value) {
        const auto number = static_cast<std::int64_t>(value);
        out.push_back(number);
        if ((number < 0 || number >= limit) && !first_bad) first_bad = i;
    };
    if (!for_each_value(array, count, use)) return false;
    if (first_bad)
        return fail(array, fmt::format("value {} of entry {} is outside [0, {})", out[*first_bad], *first_bad,
                                       limit));
    return true;
}

bool VtkXmlReader::read_points(std::size_t piece, std::vector<Point>& positions) {
    const std::size_t count = pieces_[piece].points;
    const XmlArray* points = find_array(XmlSection::points, piece, "");
    if (points == nullptr && count > 0)
        return scanner_.fail_at(pieces_[piece].begin, "a piece without points", kDamagedFile);
    if (points != nullptr && (points->components != 3 || is_integer(points->scalar)))
        return fail(*points, "points need three floating-point components");
    std::vector<double> values;
    const auto use = [&](std::size_t, auto value) { values.push_back(static_cast<double>(value)); };
    if (points != nullptr && !for_each_value(*points, 3 * count, use)) return false;
    for (std::size_t v = 0; v < count; ++v) {
        positions.emplace_back(values[3 * v], values[3 * v + 1], values[3 * v + 2]);
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(positions[v][k]))
                return fail(*points,
                            fmt::format("vertex {} has {} coordinate {}", v, "xyz"[k], positions[v][k]),
                            "give finite coordinates");
    }
    return true;
}

bool VtkXmlReader::read_rows(XmlSection section, std::size_t piece, std::size_t count,
                             std::vector<std::int64_t>& offsets, std::vector<std::int64_t>& connectivity) {
    const XmlArray* ids = find_array(section, piece, "connectivity");
    const XmlArray* ends = find_array(section, piece, "offsets");
    if (ids == nullptr || ends == nullptr)
        return scanner_.fail_at(pieces_[piece].begin, "a piece without connectivity or offsets",
                                kDamagedFile);
    std::vector<std::int64_t> numbers;
    if (!read_integers(*ends, count, std::numeric_limits<std::int64_t>::max(), numbers)) return false;
    if (!std::is_sorted(numbers.begin(), numbers.end())) return fail(*ends, "its values do not rise");
    offsets.assign(1, 0);
    offsets.insert(offsets.end(), numbers.begin(), numbers.end());
    connectivity.clear();
    const auto vertex_count = static_cast<std::int64_t>(pieces_[piece].points);
    return read_integers(*ids, static_cast<std::size_t>(offsets.back()), vertex_count, connectivity);
}

} // namespace hexopt::io_detail
