#include "io/readers.hpp"
#include "io/scalar.hpp"
#include "io/scanner.hpp"
#include "io/vtk_cells.hpp"
#include "io/vtk_header.hpp"

#include <cctype>
#include <fmt/format.h>
#include <optional>

namespace hexopt::io_detail {

namespace {

struct NamedScalar {
    std::string_view name;
    Scalar scalar;
};

// VTK writes vtkIdType as 32 bits and long as 64.
constexpr NamedScalar kScalars[] = {
    {"char", Scalar::int8},
    {"signed_char", Scalar::int8},
    {"unsigned_char", Scalar::uint8},
    {"short", Scalar::int16},
    {"unsigned_short", Scalar::uint16},
    {"int", Scalar::int32},
    {"unsigned_int", Scalar::uint32},
    {"long", Scalar::int64},
    {"unsigned_long", Scalar::uint64},
    {"vtkidtype", Scalar::int32},
    {"vtktypeint64", Scalar::int64},
    {"vtktypeuint64", Scalar::uint64},
    {"float", Scalar::float32},
    {"double", Scalar::float64},
};

/// Names and strings carry white space and other special characters as %xx.
std::string decode(std::string_view text) {
    const auto digit = [](char c) {
        return std::isdigit(static_cast<unsigned char>(c))
                   ? c - '0'
                   : std::tolower(static_cast<unsigned char>(c)) - 'a' + 10;
    };
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] == '%' && i + 2 < text.size() && std::isxdigit(static_cast<unsigned char>(text[i + 1])) &&
            std::isxdigit(static_cast<unsigned char>(text[i + 2]))) {
            out += static_cast<char>(digit(text[i + 1]) * 16 + digit(text[i + 2]));
            i += 2;
        } else {
            out += text[i];
        }
    }
    return out;
}

class LegacyVtkReader {
  public:
    LegacyVtkReader(const std::string& file, std::string_view bytes, Context& context)
        : scanner_(file, bytes), builder_(file), context_(context) {}

    Result<MeshFile> read();

  private:
    enum class Part { dataset, point_data, cell_data };

    bool read_header();
    bool read_section(const std::string& keyword);
    bool read_dataset();
    bool read_points();
    bool read_cells();
    bool read_interleaved_cells(std::size_t cell_count, std::size_t size);
    bool read_split_cells(std::size_t offset_count, std::size_t size);
    bool read_types();
    bool read_part(Part part);
    bool read_attribute(const std::string& keyword);
    bool read_scalars();
    bool read_field();
    bool read_field_array();
    bool read_strings(const std::string& name, std::size_t count);
    bool skip_lookup_table();
    bool skip_metadata();
    bool end_line();

    bool read_type(std::optional<Scalar>& scalar);
    bool read_values(std::size_t count, Scalar scalar, std::vector<double>& values, bool& exact);
    bool read_text_values(Scalar scalar, std::vector<double>& values);
    bool read_id(std::int64_t value, Index& id);
    template <class Use>
    bool for_each_integer(std::size_t count, Scalar scalar, const Use& use);
    bool keep_array(std::string name, std::size_t components, std::size_t tuples, Scalar scalar);
    std::size_t least_bytes(Scalar scalar) const { return is_binary_ ? size_of(scalar) : 2; }
    std::string place_of(std::size_t start, std::size_t number, std::size_t bytes_each) const;
    Status check_completeness() const;

    Scanner scanner_;
    MeshBuilder builder_;
    Context& context_;
    bool is_binary_ = false;
    Part part_ = Part::dataset;
    VtkCells cells_;
    VtkArrays arrays_;
    bool has_points_ = false, has_cells_ = false, has_types_ = false, is_interleaved_ = true;
    std::size_t points_start_ = 0, ids_start_ = 0;
    Scalar point_scalar_ = Scalar::float64, id_scalar_ = Scalar::int32;
};

bool LegacyVtkReader::read_header() {
    scanner_.line(); // "# vtk DataFile Version x.y", seen by looks_like_legacy_vtk()
    scanner_.line(); // title
    if (!read_vtk_format(scanner_, is_binary_)) return false;
    return end_line();
}

/// In a binary file, data start right after the end of the line.
bool LegacyVtkReader::end_line() {
    if (!is_binary_) return scanner_.ok();
    const std::string_view rest = scanner_.line();
    if (rest.find_first_not_of(" \t") != std::string_view::npos)
        return scanner_.fail(fmt::format("'{}' stands where the line should end", shown(rest)),
                             "the file is damaged; write or copy it again");
    return scanner_.ok();
}

bool LegacyVtkReader::read_type(std::optional<Scalar>& scalar) {
    const std::string name = lower(scanner_.token());
    if (!scanner_.ok()) return false;
    for (const NamedScalar& known : kScalars)
        if (known.name == name) scalar = known.scalar;
    if (!scalar && name != "bit" && name != "string" && name != "utf8_string")
        return scanner_.fail(fmt::format("'{}' is no number type of VTK", shown(name)),
                             "write the file with float, double, int or vtktypeint64 arrays");
    if (!scalar && name == "bit" && is_binary_)
        return scanner_.fail("a binary array of bits", "write that array as unsigned_char");
    if (!scalar && name == "bit") scalar = Scalar::uint8;
    return true;
}

bool LegacyVtkReader::read_text_values(Scalar scalar, std::vector<double>& values) {
    for (double& value : values) {
        std::int64_t integer = 0;
        if (is_integer(scalar)) {
            if (!scanner_.read_int(integer)) return false;
            value = static_cast<double>(integer);
        } else if (!(scalar == Scalar::float32 ? scanner_.read_float(value) : scanner_.read_double(value))) {
            return false;
        }
    }
    return true;
}

bool LegacyVtkReader::read_values(std::size_t count, Scalar scalar, std::vector<double>& values,
                                  bool& exact) {
    if (!scanner_.check_count(count, "numbers", least_bytes(scalar))) return false;
    values.resize(count);
    exact = true;
    if (is_binary_) {
        const std::string_view raw = scanner_.raw(count * size_of(scalar));
        for_each_scalar(scalar, raw, std::endian::big,
                        [&](std::size_t i, auto value) { values[i] = static_cast<double>(value); });
    } else if (!read_text_values(scalar, values)) {
        return false;
    }
    if (is_integer(scalar))
        for (double value : values)
            exact = exact && value <= kMostExactInteger && value >= -kMostExactInteger;
    return scanner_.ok();
}

template <class Use>
bool LegacyVtkReader::for_each_integer(std::size_t count, Scalar scalar, const Use& use) {
    if (!is_integer(scalar))
        return scanner_.fail("ids of a floating-point type", "write them as vtktypeint64");
    if (!scanner_.check_count(count, "numbers", least_bytes(scalar))) return false;
    if (is_binary_) {
        bool good = true;
        const std::string_view raw = scanner_.raw(count * size_of(scalar));
        for_each_scalar(scalar, raw, std::endian::big, [&](std::size_t i, auto value) {
            good = good && use(i, static_cast<std::int64_t>(value));
        });
        return good && scanner_.ok();
    }
    for (std::size_t i = 0; i < count; ++i) {
        std::int64_t value = 0;
        if (!scanner_.read_int(value) || !use(i, value)) return false;
    }
    return true;
}

bool LegacyVtkReader::read_id(std::int64_t value, Index& id) {
    if (value < 0 || value >= kNoIndex)
        return scanner_.fail(fmt::format("vertex id {}", value),
                             "the file is damaged; write or copy it again");
    id = static_cast<Index>(value);
    return true;
}

bool LegacyVtkReader::read_dataset() {
    const std::string type = lower(scanner_.token());
    if (type != "unstructured_grid")
        return scanner_.fail(fmt::format("the data set is '{}'", shown(type)),
                             "give an UNSTRUCTURED_GRID of hexahedra");
    return true;
}

bool LegacyVtkReader::read_points() {
    std::size_t count = 0;
    std::optional<Scalar> scalar;
    if (!scanner_.read_count(count, "points", is_binary_ ? 3 : 6) || !read_type(scalar)) return false;
    if (std::exchange(has_points_, true)) return scanner_.fail("a second list of points", "keep one");
    if (!scalar) return scanner_.fail("points that are no numbers", "write them as double");
    if (!end_line()) return false;
    points_start_ = scanner_.position();
    point_scalar_ = *scalar;
    std::vector<double> values;
    bool exact = true;
    // Many programs write all digits of a double under the heading "float": in text they are kept.
    const Scalar stored = is_binary_ ? *scalar : Scalar::float64;
    if (!read_values(3 * count, stored, values, exact)) return false;
    builder_.mesh.positions.resize(count);
    for (std::size_t v = 0; v < count; ++v)
        builder_.mesh.positions[v] = {values[3 * v], values[3 * v + 1], values[3 * v + 2]};
    return true;
}

bool LegacyVtkReader::read_cells() {
    std::size_t count = 0, size = 0;
    if (!scanner_.read_count(count, "cells", 1) || !scanner_.read_count(size, "cell entries", 1))
        return false;
    if (std::exchange(has_cells_, true)) return scanner_.fail("a second list of cells", "keep one");
    if (!end_line()) return false;
    // Version 5.1 of the format writes two arrays instead; binary numbers cannot look like their heading.
    is_interleaved_ = lower(scanner_.peek()) != "offsets";
    return is_interleaved_ ? read_interleaved_cells(count, size) : read_split_cells(count, size);
}

bool LegacyVtkReader::read_interleaved_cells(std::size_t cell_count, std::size_t size) {
    if (size < cell_count)
        return scanner_.fail(fmt::format("{} entries for {} cells", size, cell_count),
                             "the second number counts ids too");
    ids_start_ = scanner_.position();
    cells_.offsets.assign(1, 0);
    cells_.offsets.reserve(cell_count + 1);
    cells_.connectivity.reserve(size - cell_count);
    std::int64_t left = 0;
    const auto use = [&](std::size_t, std::int64_t value) {
        if (left == 0) {
            if (value < 0 || cells_.offsets.size() > cell_count ||
                static_cast<std::uint64_t>(value) > size - cell_count - cells_.offsets.back())
                return scanner_.fail(fmt::format("a cell of {} vertices does not fit into the list", value),
                                     "the file is damaged; write or copy it again");
            cells_.offsets.push_back(cells_.offsets.back() + static_cast<std::uint64_t>(value));
            left = value;
            return true;
        }
        --left;
        return read_id(value, cells_.connectivity.emplace_back());
    };
    if (!for_each_integer(size, Scalar::int32, use)) return false;
    if (left != 0 || cells_.offsets.size() != cell_count + 1)
        return scanner_.fail(
            fmt::format("the list holds {} cells, not {}", cells_.offsets.size() - 1, cell_count),
            "the file is damaged; write or copy it again");
    return true;
}

bool LegacyVtkReader::read_split_cells(std::size_t offset_count, std::size_t size) {
    std::optional<Scalar> offset_scalar, id_scalar;
    scanner_.token(); // OFFSETS
    if (!read_type(offset_scalar) || !end_line()) return false;
    if (!offset_scalar || offset_count == 0)
        return scanner_.fail("no offsets of cells", "the file is damaged");
    const auto use_offset = [&](std::size_t i, std::int64_t value) {
        const bool is_rising =
            i == 0 ? value == 0 : value >= static_cast<std::int64_t>(cells_.offsets.back());
        if (!is_rising || value > static_cast<std::int64_t>(size))
            return scanner_.fail(fmt::format("offset {} of cell {} is out of order", value, i),
                                 "the file is damaged");
        cells_.offsets.push_back(static_cast<std::uint64_t>(value));
        return true;
    };
    if (!for_each_integer(offset_count, *offset_scalar, use_offset)) return false;
    if (cells_.offsets.back() != size)
        return scanner_.fail(fmt::format("the offsets end at {}, not {}", cells_.offsets.back(), size),
                             "the file is damaged");
    if (lower(scanner_.token()) != "connectivity")
        return scanner_.fail("no CONNECTIVITY after OFFSETS", "the file is damaged or cut short");
    if (!read_type(id_scalar) || !end_line()) return false;
    if (!id_scalar) return scanner_.fail("ids that are no numbers", "the file is damaged");
    ids_start_ = scanner_.position();
    id_scalar_ = *id_scalar;
    if (!scanner_.check_count(size, "vertex ids", least_bytes(id_scalar_))) return false;
    cells_.connectivity.resize(size);
    return for_each_integer(size, id_scalar_, [&](std::size_t i, std::int64_t value) {
        return read_id(value, cells_.connectivity[i]);
    });
}

bool LegacyVtkReader::read_types() {
    std::size_t count = 0;
    if (!scanner_.read_count(count, "cell types", is_binary_ ? 4 : 2) || !end_line()) return false;
    if (std::exchange(has_types_, true)) return scanner_.fail("a second list of cell types", "keep one");
    cells_.types.resize(count);
    return for_each_integer(count, Scalar::int32, [&](std::size_t i, std::int64_t value) {
        if (value < 0 || value > 255)
            return scanner_.fail(fmt::format("cell type {}", value), "the file is damaged");
        cells_.types[i] = static_cast<std::uint8_t>(value);
        return true;
    });
}

bool LegacyVtkReader::read_part(Part part) {
    std::size_t count = 0;
    if (!scanner_.read_count(count, part == Part::point_data ? "points" : "cells", 0) || !end_line())
        return false;
    const std::size_t expected = part == Part::point_data ? builder_.mesh.positions.size() : cells_.count();
    if (count != expected)
        return scanner_.fail(fmt::format("data for {} {}, but there are {}", count,
                                         part == Part::point_data ? "points" : "cells", expected),
                             "the file is damaged; write or copy it again");
    part_ = part;
    return true;
}

bool LegacyVtkReader::keep_array(std::string name, std::size_t components, std::size_t tuples,
                                 Scalar scalar) {
    if (components > 0 && tuples > scanner_.bytes().size() / components)
        return scanner_.fail(
            fmt::format("array {} announces {} times {} numbers", shown(name), tuples, components),
            "the file is cut short or damaged");
    FieldData field{std::move(name),
                    part_ == Part::point_data ? FieldLocation::point : FieldLocation::cell,
                    static_cast<std::uint32_t>(components),
                    {},
                    field_type_of(scalar)};
    bool exact = true;
    if (!read_values(components * tuples, scalar, field.values, exact)) return false;
    if (!exact) {
        context_.log(LogLevel::warning,
                     fmt::format("{}: array {} is left out: it holds integers beyond 53 bits",
                                 scanner_.file(), shown(field.name)));
        return true;
    }
    if (components == 0 || field.name.empty()) return true;
    (part_ == Part::dataset      ? arrays_.field
     : part_ == Part::point_data ? arrays_.point
                                 : arrays_.cell)
        .push_back(std::move(field));
    return true;
}

bool LegacyVtkReader::read_scalars() {
    const std::string name = decode(scanner_.token());
    std::optional<Scalar> scalar;
    if (!read_type(scalar)) return false;
    if (!scalar) return scanner_.fail("scalars that are no numbers", "remove that array");
    Scanner rest("", scanner_.line());
    std::int64_t components = 1;
    if (!rest.at_end() && (!rest.read_int(components) || components < 1 || components > 4))
        return scanner_.fail("a wrong number of components", "SCALARS have 1 to 4");
    if (lower(scanner_.peek()) == "lookup_table") scanner_.line();
    const std::size_t tuples = part_ == Part::point_data ? builder_.mesh.positions.size() : cells_.count();
    return keep_array(name, static_cast<std::size_t>(components), tuples, *scalar);
}

bool LegacyVtkReader::read_attribute(const std::string& keyword) {
    const std::size_t tuples = part_ == Part::point_data ? builder_.mesh.positions.size() : cells_.count();
    const std::string name = decode(scanner_.token());
    std::optional<Scalar> scalar;
    std::size_t components = keyword == "vectors" || keyword == "normals" ? 3
                             : keyword == "tensors"                       ? 9
                             : keyword == "tensors6"                      ? 6
                                                                          : 1;
    if (keyword == "color_scalars") {
        if (!scanner_.read_count(components, "components", 0) || !end_line()) return false;
        return keep_array(name, components, tuples, is_binary_ ? Scalar::uint8 : Scalar::float32);
    }
    if (keyword == "texture_coordinates" && !scanner_.read_count(components, "components", 0)) return false;
    if (!read_type(scalar) || !end_line()) return false;
    if (!scalar) return scanner_.fail("an attribute that is no number", "remove that array");
    return keep_array(name, components, tuples, *scalar);
}

bool LegacyVtkReader::read_field() {
    std::size_t count = 0;
    scanner_.token(); // name of the whole
    if (!scanner_.read_count(count, "arrays", 1) || !end_line()) return false;
    for (std::size_t i = 0; i < count; ++i) {
        if (lower(scanner_.peek()) == "metadata") scanner_.token(), skip_metadata();
        if (!read_field_array()) return false;
    }
    return true;
}

bool LegacyVtkReader::read_field_array() {
    const std::string name = decode(scanner_.token());
    if (name == "NULL_ARRAY") return end_line();
    std::size_t components = 0, tuples = 0;
    std::optional<Scalar> scalar;
    if (!scanner_.read_count(components, "components", 0) || !scanner_.read_count(tuples, "tuples", 0) ||
        !read_type(scalar))
        return false;
    const std::size_t expected = part_ == Part::point_data ? builder_.mesh.positions.size() : cells_.count();
    if (part_ != Part::dataset && tuples != expected)
        return scanner_.fail(
            fmt::format("array {} has {} tuples, but there are {}", shown(name), tuples, expected),
            "the file is damaged; write or copy it again");
    if (scalar) return end_line() && keep_array(name, components, tuples, *scalar);
    scanner_.line();
    if (components > 1)
        return scanner_.fail(fmt::format("array {} of string tuples", shown(name)), "remove it");
    return read_strings(name, components * tuples);
}

/// ASCII: one a line, encoded. Binary: each after its length, whose two top bits say in how many bytes.
bool LegacyVtkReader::read_strings(const std::string& name, std::size_t count) {
    if (!scanner_.check_count(count, "strings", 1)) return false;
    for (std::size_t i = 0; i < count; ++i) {
        std::string text;
        if (!is_binary_) {
            text = decode(scanner_.line());
        } else {
            const std::string_view first = scanner_.raw(1);
            if (first.empty()) return false;
            const int bytes = 1 << (3 - (static_cast<unsigned char>(first[0]) >> 6));
            std::uint64_t length = static_cast<unsigned char>(first[0]) & 0x3F;
            for (char c : scanner_.raw(static_cast<std::size_t>(bytes - 1)))
                length = length << 8 | static_cast<unsigned char>(c);
            text = std::string(scanner_.raw(length));
        }
        if (!scanner_.ok()) return false;
        if (name == "hexopt_patch_name") arrays_.patch_names.push_back(std::move(text));
    }
    return true;
}

bool LegacyVtkReader::skip_lookup_table() {
    constexpr std::size_t kChannels = 4;
    std::size_t size = 0;
    std::vector<double> values;
    bool exact = true;
    scanner_.token(); // name
    if (!scanner_.read_count(size, "colours", is_binary_ ? kChannels : 2 * kChannels) || !end_line())
        return false;
    return read_values(kChannels * size, is_binary_ ? Scalar::uint8 : Scalar::float32, values, exact);
}

/// Up to an empty line.
bool LegacyVtkReader::skip_metadata() {
    scanner_.line();
    while (scanner_.ok() && scanner_.remaining() > 0)
        if (scanner_.line().find_first_not_of(" \t") == std::string_view::npos) break;
    return scanner_.ok();
}

bool LegacyVtkReader::read_section(const std::string& keyword) {
    if (keyword == "dataset") return read_dataset();
    if (keyword == "points") return read_points();
    if (keyword == "cells") return read_cells();
    if (keyword == "cell_types") return read_types();
    if (keyword == "point_data") return read_part(Part::point_data);
    if (keyword == "cell_data") return read_part(Part::cell_data);
    if (keyword == "field") return read_field();
    if (keyword == "metadata") return skip_metadata();
    if (keyword == "lookup_table") return skip_lookup_table();
    if (part_ != Part::dataset) {
        if (keyword == "scalars") return read_scalars();
        for (const char* attribute : {"color_scalars", "vectors", "normals", "texture_coordinates", "tensors",
                                      "tensors6", "global_ids", "pedigree_ids", "edge_flags"})
            if (keyword == attribute) return read_attribute(keyword);
    }
    return scanner_.fail(fmt::format("'{}' stands where a keyword should", shown(keyword)),
                         "the file is damaged or a count before this place is wrong");
}

Status LegacyVtkReader::check_completeness() const {
    const char* missing = !has_points_  ? "POINTS"
                          : !has_cells_ ? "CELLS"
                          : !has_types_ ? "CELL_TYPES"
                                        : nullptr;
    if (missing != nullptr)
        return Error{
            ErrorCode::bad_input,
            "read",
            scanner_.file(),
            {fmt::format("the file ends without {}", missing), "it is cut short; write or copy it again"}};
    if (cells_.offsets.size() != cells_.count() + 1)
        return Error{ErrorCode::bad_input,
                     "read",
                     scanner_.file(),
                     {fmt::format("{} cells, but {} cell types", cells_.offsets.size() - 1, cells_.count()),
                      "the file is damaged; write or copy it again"}};
    return Done{};
}

std::string LegacyVtkReader::place_of(std::size_t start, std::size_t number, std::size_t bytes_each) const {
    return is_binary_ ? scanner_.byte_place(start + number * bytes_each)
                      : scanner_.place(scanner_.find_token(start, number));
}

Result<MeshFile> LegacyVtkReader::read() {
    if (!read_header()) return scanner_.error();
    while (!scanner_.at_end())
        if (!read_section(lower(scanner_.token()))) return scanner_.error();
    if (!scanner_.ok()) return scanner_.error();
    if (Status status = check_completeness(); !status) return status.error();
    const Locate locate_cell = [&](std::size_t cell) {
        return place_of(ids_start_, cells_.offsets[cell] + (is_interleaved_ ? cell : 0),
                        is_interleaved_ ? 4 : size_of(id_scalar_));
    };
    VtkCellMap map;
    if (Status status = add_vtk_cells(builder_, cells_, map, locate_cell); !status) return status.error();
    if (Status status = add_vtk_arrays(builder_, std::move(arrays_), map, cells_.count(), context_); !status)
        return status.error();
    return builder_.finish(
        [&](std::size_t point) { return place_of(points_start_, 3 * point, size_of(point_scalar_)); },
        [&](std::size_t hexahedron) { return locate_cell(map.hexahedra[hexahedron]); }, context_);
}

} // namespace

bool looks_like_legacy_vtk(std::string_view bytes) {
    constexpr std::string_view kMagic = "# vtk datafile version";
    return lower(bytes.substr(0, kMagic.size())) == kMagic;
}

Result<MeshFile> read_legacy_vtk(const std::string& file, std::string_view bytes, Context& context) {
    return LegacyVtkReader(file, bytes, context).read();
}

bool read_vtk_format(Scanner& scanner, bool& is_binary) {
    const std::string format = lower(scanner.token());
    if (format != "ascii" && format != "binary")
        return scanner.fail(fmt::format("'{}' stands where ASCII or BINARY should", shown(format)),
                            "the third line of a VTK file names its format");
    is_binary = format == "binary";
    if (is_binary) scanner.set_binary();
    return true;
}

} // namespace hexopt::io_detail
