#include "io/readers.hpp"
#include "io/scalar.hpp"
#include "io/vtk_cells.hpp"
#include "io/vtu_blocks.hpp"
#include "io/vtu_pieces.hpp"
#include "io/xml_tags.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace hexopt::io_detail {

namespace {

constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";

enum class Section : std::uint8_t { none, field_data, point_data, cell_data, points, cells };
enum class Format : std::uint8_t { ascii, binary, appended };

constexpr std::pair<std::string_view, Section> kSections[] = {{"FieldData", Section::field_data},
                                                              {"PointData", Section::point_data},
                                                              {"CellData", Section::cell_data},
                                                              {"Points", Section::points},
                                                              {"Cells", Section::cells}};

constexpr std::pair<std::string_view, Scalar> kScalars[] = {
    {"Int8", Scalar::int8},       {"UInt8", Scalar::uint8},   {"Int16", Scalar::int16},
    {"UInt16", Scalar::uint16},   {"Int32", Scalar::int32},   {"UInt32", Scalar::uint32},
    {"Int64", Scalar::int64},     {"UInt64", Scalar::uint64}, {"Float32", Scalar::float32},
    {"Float64", Scalar::float64}, {"String", Scalar::int8}};

/// A DataArray element; its data are decoded later.
struct ArrayTag {
    Section section = Section::none;
    std::size_t piece = 0;
    std::string name;
    Scalar scalar = Scalar::float64;
    bool is_string = false;
    std::uint32_t components = 1;
    Format format = Format::ascii;
    std::size_t offset = 0;                   ///< of appended data
    std::size_t begin = 0;                    ///< position of the tag
    std::size_t text_begin = 0, text_end = 0; ///< inline data
};

struct PieceTag {
    std::size_t begin = 0, points = 0, cells = 0;
};

class VtuReader {
  public:
    VtuReader(const std::string& file, std::string_view bytes, Context& context)
        : scanner_(file, bytes), builder_(file), context_(context) {}

    Result<MeshFile> read();

  private:
    bool read_tags();
    bool read_tag(const XmlTag& tag);
    bool read_file_tag(const XmlTag& tag);
    bool read_piece_tag(const XmlTag& tag);
    bool read_array_tag(const XmlTag& tag);
    bool start_appended(const XmlTag& tag);
    bool read_number(const XmlTag& tag, const char* attribute, std::size_t& value,
                     std::optional<std::size_t> fallback = {});

    const ArrayTag* find_array(Section section, std::size_t piece, std::string_view name) const;
    template <class Use>
    bool for_each_value(const ArrayTag& array, std::optional<std::size_t> count, const Use& use);
    bool decode(const ArrayTag& array, std::optional<std::size_t> count, std::string& content);
    std::string_view appended_slice(const ArrayTag& array) const;
    bool read_integers(const ArrayTag& array, std::optional<std::size_t> count, std::int64_t limit,
                       std::vector<std::int64_t>& out);
    bool read_piece(std::size_t piece, VtuPiece& out);
    bool read_piece_cells(std::size_t piece, VtkCells& cells);
    bool read_arrays(Section section, std::size_t piece, std::size_t count, std::vector<FieldData>& out);
    bool read_array(const ArrayTag& array, std::optional<std::size_t> count, std::vector<FieldData>& out);
    bool read_field_data();
    bool fail(const ArrayTag& array, std::string reason, std::string advice = kDamaged) {
        return scanner_.fail_at(array.begin, fmt::format("array {}: {}", shown(array.name), reason),
                                std::move(advice));
    }

    Scanner scanner_;
    MeshBuilder builder_;
    Context& context_;
    BlockLayout layout_;
    std::vector<ArrayTag> arrays_;
    std::vector<PieceTag> pieces_;
    std::vector<std::size_t> offsets_; ///< of all appended arrays, rising
    VtkArrays kept_;
    Section section_ = Section::none;
    bool has_file_tag_ = false, has_grid_tag_ = false, is_in_piece_ = false;
    std::optional<std::size_t> appended_begin_;
    bool appended_is_raw_ = true;
    std::size_t appended_used_ = 0;
};

bool VtuReader::read_number(const XmlTag& tag, const char* attribute, std::size_t& value,
                            std::optional<std::size_t> fallback) {
    const std::string* text = tag.find(attribute);
    if (text == nullptr && fallback) return value = *fallback, true;
    if (text == nullptr)
        return scanner_.fail_at(tag.begin, fmt::format("{} without {}", shown(tag.name), attribute),
                                kDamaged);
    std::string_view digits = *text;
    while (digits.starts_with(' ')) digits.remove_prefix(1);
    while (digits.ends_with(' ')) digits.remove_suffix(1);
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (code != std::errc() || end != digits.data() + digits.size())
        return scanner_.fail_at(tag.begin, fmt::format("{}=\"{}\" is no count", attribute, shown(*text)),
                                kDamaged);
    return true;
}

bool VtuReader::read_file_tag(const XmlTag& tag) {
    const auto value = [&](const char* attribute, const char* fallback) {
        const std::string* text = tag.find(attribute);
        return text != nullptr ? *text : std::string(fallback);
    };
    const auto refuse = [&](const char* attribute, const std::string& text, const char* advice) {
        return scanner_.fail_at(tag.begin, fmt::format("{} '{}' is not supported", attribute, shown(text)),
                                advice);
    };
    has_file_tag_ = true;
    if (const std::string type = value("type", ""); type != "UnstructuredGrid")
        return refuse("type", type,
                      type == "PUnstructuredGrid" ? "give the .vtu files that it names, one by one"
                                                  : "give an UnstructuredGrid");
    const std::string order = value("byte_order", "LittleEndian");
    if (order != "LittleEndian" && order != "BigEndian") return refuse("byte_order", order, kDamaged);
    layout_.order = order == "BigEndian" ? std::endian::big : std::endian::little;
    const std::string header = value("header_type", "UInt32");
    if (header != "UInt32" && header != "UInt64") return refuse("header_type", header, kDamaged);
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

bool VtuReader::read_piece_tag(const XmlTag& tag) {
    if (!tag.is_start || tag.is_end) is_in_piece_ = false;
    if (!tag.is_start) return true;
    PieceTag piece;
    piece.begin = tag.begin;
    if (!read_number(tag, "NumberOfPoints", piece.points) || !read_number(tag, "NumberOfCells", piece.cells))
        return false;
    if (piece.points >= kNoIndex || piece.cells >= kNoIndex)
        return scanner_.fail_at(tag.begin,
                                fmt::format("a piece of {} points and {} cells", piece.points, piece.cells),
                                "the file is damaged or too large; split the mesh");
    is_in_piece_ = !tag.is_end;
    pieces_.push_back(piece);
    return true;
}

bool VtuReader::read_array_tag(const XmlTag& tag) {
    constexpr std::size_t kMostComponents = 1u << 20;
    if (!tag.is_start || section_ == Section::none) return true;
    if (section_ != Section::field_data && !is_in_piece_) return true;
    ArrayTag array;
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
        array.format = Format::ascii;
    else if (*format == "binary")
        array.format = Format::binary;
    else if (*format == "appended")
        array.format = Format::appended;
    else
        return fail(array, fmt::format("format '{}' is not known", shown(*format)));
    if (array.format == Format::appended && !read_number(tag, "offset", array.offset)) return false;
    arrays_.push_back(std::move(array));
    return true;
}

bool VtuReader::start_appended(const XmlTag& tag) {
    const std::string* encoding = tag.find("encoding");
    const std::string text = encoding == nullptr ? "base64" : *encoding;
    if (text != "raw" && text != "base64")
        return scanner_.fail_at(tag.begin, fmt::format("encoding '{}' is not known", shown(text)), kDamaged);
    appended_is_raw_ = text == "raw";
    const std::size_t mark = scanner_.bytes().find_first_not_of(" \t\r\n", tag.end);
    if (mark == std::string_view::npos || scanner_.bytes()[mark] != '_')
        return scanner_.fail_at(tag.end, "appended data do not start with _", kDamaged);
    appended_begin_ = mark + 1;
    return true;
}

bool VtuReader::read_tag(const XmlTag& tag) {
    if (tag.name == "VTKFile") return !tag.is_start || read_file_tag(tag);
    if (tag.name == "UnstructuredGrid") return has_grid_tag_ = true;
    if (tag.name == "Piece") return read_piece_tag(tag);
    if (tag.name == "DataArray" || tag.name == "Array") return read_array_tag(tag);
    if (tag.name == "AppendedData") return !tag.is_start || start_appended(tag);
    for (const auto& [name, section] : kSections)
        if (tag.name == name) section_ = tag.is_start && !tag.is_end ? section : Section::none;
    return true;
}

bool VtuReader::read_tags() {
    XmlTag tag;
    while (!appended_begin_ && next_tag(scanner_, tag)) {
        if (!has_file_tag_ && tag.name != "VTKFile")
            return scanner_.fail_at(tag.begin, "no VTKFile element", kDamaged);
        if (!read_tag(tag)) return false;
        if (tag.name == "VTKFile" && !tag.is_start) break;
    }
    if (!scanner_.ok()) return false;
    const bool is_whole = appended_begin_ || (tag.name == "VTKFile" && !tag.is_start);
    if (!has_file_tag_ || !has_grid_tag_ || pieces_.empty() || !is_whole)
        return scanner_.fail_at(scanner_.bytes().size(), "the file ends without its grid", kDamaged);
    for (const ArrayTag& array : arrays_) {
        if (array.format != Format::appended) continue;
        if (!appended_begin_) return fail(array, "its appended data are missing");
        offsets_.push_back(array.offset);
    }
    std::sort(offsets_.begin(), offsets_.end());
    return true;
}

const ArrayTag* VtuReader::find_array(Section section, std::size_t piece, std::string_view name) const {
    const auto found = std::find_if(arrays_.begin(), arrays_.end(), [&](const ArrayTag& a) {
        return a.section == section && a.piece == piece && (name.empty() || a.name == name);
    });
    return found == arrays_.end() ? nullptr : &*found;
}

/// The appended bytes of an array: for base64, which must be decoded whole, up to the next array.
std::string_view VtuReader::appended_slice(const ArrayTag& array) const {
    const std::string_view all = scanner_.bytes().substr(*appended_begin_);
    if (array.offset >= all.size()) return {};
    const auto next = std::upper_bound(offsets_.begin(), offsets_.end(), array.offset);
    const bool is_last = next == offsets_.end();
    if (appended_is_raw_) return all.substr(array.offset);
    const std::size_t end =
        is_last ? std::min(all.find('<', array.offset), all.size()) : std::min(*next, all.size());
    return all.substr(array.offset, end - array.offset);
}

bool VtuReader::decode(const ArrayTag& array, std::optional<std::size_t> count, std::string& content) {
    std::string decoded;
    std::string_view bytes;
    if (array.format == Format::appended && appended_is_raw_) {
        bytes = appended_slice(array);
    } else {
        const std::string_view text =
            array.format == Format::appended
                ? appended_slice(array)
                : scanner_.bytes().substr(array.text_begin, array.text_end - array.text_begin);
        appended_used_ += array.format == Format::appended ? text.size() : 0;
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
    if (array.format == Format::appended && appended_is_raw_) appended_used_ += block->size;
    if (appended_used_ > scanner_.bytes().size()) return fail(array, "appended arrays overlap");
    content = std::move(block->content);
    return true;
}

/// Calls use(i, value) for each number of an array, in a type that holds it: std::int64_t or double for text.
template <class Use>
bool VtuReader::for_each_value(const ArrayTag& array, std::optional<std::size_t> count, const Use& use) {
    if (array.format != Format::ascii) {
        std::string content;
        if (!decode(array, count, content)) return false;
        for_each_scalar(array.scalar, content, layout_.order, use);
        return true;
    }
    Scanner text(scanner_.file(), scanner_.bytes().substr(0, array.text_end));
    text.seek(array.text_begin);
    if (count && !text.check_count(*count, "numbers", 2)) return scanner_.adopt(text.error());
    // Positions keep all digits, whatever their type.
    const bool is_rounded = array.scalar == Scalar::float32 && array.section != Section::points;
    std::size_t i = 0;
    for (; !text.at_end() && (!count || i < *count); ++i) {
        std::int64_t integer = 0;
        double number = 0;
        if (!(is_integer(array.scalar) ? text.read_int(integer)
              : is_rounded             ? text.read_float(number)
                                       : text.read_double(number)))
            return scanner_.adopt(text.error());
        is_integer(array.scalar) ? use(i, integer) : use(i, number);
    }
    if (count && (i < *count || !text.at_end()))
        return fail(array, fmt::format("{} numbers stand where {} are needed", i < *count ? "fewer" : "more",
                                       *count));
    return true;
}

/// Whole numbers of [0, limit).
bool VtuReader::read_integers(const ArrayTag& array, std::optional<std::size_t> count, std::int64_t limit,
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

bool VtuReader::read_piece_cells(std::size_t piece, VtkCells& cells) {
    const std::size_t count = pieces_[piece].cells;
    const ArrayTag* connectivity = find_array(Section::cells, piece, "connectivity");
    const ArrayTag* offsets = find_array(Section::cells, piece, "offsets");
    const ArrayTag* types = find_array(Section::cells, piece, "types");
    if (count == 0) return cells.offsets.assign(1, 0), true;
    if (connectivity == nullptr || offsets == nullptr || types == nullptr)
        return scanner_.fail_at(pieces_[piece].begin, "a piece without connectivity, offsets or types",
                                kDamaged);
    std::vector<std::int64_t> numbers;
    if (!read_integers(*types, count, 256, numbers)) return false;
    cells.types.assign(numbers.begin(), numbers.end());
    numbers.clear();
    if (!read_integers(*offsets, count, std::numeric_limits<std::int64_t>::max(), numbers)) return false;
    cells.offsets.assign(1, 0);
    cells.offsets.insert(cells.offsets.end(), numbers.begin(), numbers.end());
    if (!std::is_sorted(cells.offsets.begin(), cells.offsets.end()))
        return fail(*offsets, "its values do not rise");
    numbers.clear();
    const auto vertex_count = static_cast<std::int64_t>(pieces_[piece].points);
    if (!read_integers(*connectivity, cells.offsets.back(), vertex_count, numbers)) return false;
    cells.connectivity.assign(numbers.begin(), numbers.end());
    return true;
}

bool VtuReader::read_array(const ArrayTag& array, std::optional<std::size_t> count,
                           std::vector<FieldData>& out) {
    const FieldLocation location =
        array.section == Section::point_data ? FieldLocation::point : FieldLocation::cell;
    FieldData field{array.name, location, array.components, {}, field_type_of(array.scalar)};
    bool is_exact = true;
    const auto use = [&](std::size_t, auto value) {
        const auto number = static_cast<double>(value);
        field.values.push_back(number);
        is_exact = is_exact && (!is_integer(array.scalar) ||
                                (number <= kMostExactInteger && number >= -kMostExactInteger));
    };
    if (!for_each_value(array, count, use)) return false;
    if (is_exact && !field.name.empty()) {
        out.push_back(std::move(field));
    } else {
        context_.log(LogLevel::warning,
                     fmt::format("{}: array {} is left out: {}", scanner_.place(array.begin),
                                 shown(array.name),
                                 is_exact ? "it has no name" : "it holds integers beyond 53 bits"));
    }
    return true;
}

bool VtuReader::read_arrays(Section section, std::size_t piece, std::size_t count,
                            std::vector<FieldData>& out) {
    for (const ArrayTag& array : arrays_) {
        if (array.section != section || array.piece != piece) continue;
        if (array.is_string) {
            context_.log(LogLevel::warning, fmt::format("{}: array {} is left out: it holds text",
                                                        scanner_.place(array.begin), shown(array.name)));
            continue;
        }
        if (!read_array(array, count * array.components, out)) return false;
    }
    return true;
}

bool VtuReader::read_piece(std::size_t piece, VtuPiece& out) {
    const std::size_t count = pieces_[piece].points;
    const ArrayTag* points = find_array(Section::points, piece, "");
    if (points == nullptr && count > 0)
        return scanner_.fail_at(pieces_[piece].begin, "a piece without points", kDamaged);
    if (points != nullptr && (points->components != 3 || is_integer(points->scalar)))
        return fail(*points, "points need three floating-point components");
    std::vector<double> values;
    const auto use = [&](std::size_t, auto value) { values.push_back(static_cast<double>(value)); };
    if (points != nullptr && !for_each_value(*points, 3 * count, use)) return false;
    for (std::size_t v = 0; v < count; ++v) {
        out.positions.emplace_back(values[3 * v], values[3 * v + 1], values[3 * v + 2]);
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(out.positions[v][k]))
                return fail(*points,
                            fmt::format("vertex {} has {} coordinate {}", v, "xyz"[k], out.positions[v][k]),
                            "give finite coordinates");
    }
    return read_piece_cells(piece, out.cells) && read_arrays(Section::point_data, piece, count, out.point) &&
           read_arrays(Section::cell_data, piece, pieces_[piece].cells, out.cell);
}

bool VtuReader::read_field_data() {
    for (const ArrayTag& array : arrays_) {
        if (array.section != Section::field_data) continue;
        if (!array.name.starts_with("hexopt_")) {
            context_.log(LogLevel::info,
                         fmt::format("{}: field array {} is left out", scanner_.file(), shown(array.name)));
            continue;
        }
        if (pieces_.size() > 1)
            return fail(array, "in a file of several pieces, where vertices have no common numbers",
                        "remove it or write the mesh as one piece");
        if (!array.is_string) {
            if (!read_array(array, std::nullopt, kept_.field)) return false;
        } else if (array.name == "hexopt_patch_name") {
            std::string text;
            const auto use = [&](std::size_t, auto value) { text += static_cast<char>(value); };
            if (!for_each_value(array, std::nullopt, use)) return false;
            for (std::size_t begin = 0, end; (end = text.find('\0', begin)) != std::string::npos;
                 begin = end + 1)
                kept_.patch_names.push_back(text.substr(begin, end - begin));
        }
    }
    return true;
}

Result<MeshFile> VtuReader::read() {
    if (!read_tags() || !read_field_data()) return scanner_.error();
    std::vector<VtuPiece> pieces(pieces_.size());
    for (std::size_t p = 0; p < pieces.size(); ++p) {
        if (context_.is_cancelled())
            return make_error(ErrorCode::cancelled, "read", scanner_.file(), "cancelled while reading");
        if (!read_piece(p, pieces[p])) return scanner_.error();
    }
    VtuPiece whole = join_pieces(std::move(pieces), scanner_.file(), context_);
    builder_.mesh.positions = std::move(whole.positions);
    kept_.point = std::move(whole.point);
    kept_.cell = std::move(whole.cell);
    const Locate locate_cell = [&](std::size_t cell) {
        return fmt::format("{}: cell {}", scanner_.file(), cell);
    };
    VtkCellMap map;
    if (Status status = add_vtk_cells(builder_, whole.cells, map, locate_cell); !status)
        return status.error();
    if (Status status = add_vtk_arrays(builder_, std::move(kept_), map, whole.cells.count(), context_);
        !status)
        return status.error();
    return builder_.finish(
        [&](std::size_t point) { return fmt::format("{}: point {}", scanner_.file(), point); },
        [&](std::size_t hexahedron) { return locate_cell(map.hexahedra[hexahedron]); }, context_);
}

} // namespace

bool looks_like_vtu(std::string_view bytes) {
    constexpr std::size_t kPrologue = 4096;
    const std::string_view start = bytes.substr(0, kPrologue);
    const std::size_t first = start.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
    return first != std::string_view::npos && start[first] == '<' &&
           start.find("<VTKFile") != std::string_view::npos;
}

Result<MeshFile> read_vtu(const std::string& file, std::string_view bytes, Context& context) {
    return VtuReader(file, bytes, context).read();
}

} // namespace hexopt::io_detail
