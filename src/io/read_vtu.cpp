#include "io/readers.hpp"
#include "io/vtk_cells.hpp"
#include "io/vtk_xml.hpp"
#include "io/vtu_pieces.hpp"

namespace hexopt::io_detail {

namespace {

class VtuReader : VtkXmlReader {
  public:
    VtuReader(const std::string& file, std::string_view bytes, Context& context)
        : VtkXmlReader(file, bytes, "UnstructuredGrid"), builder_(file), context_(context) {}

    Result<MeshFile> read();

  private:
    bool read_piece(std::size_t piece, VtuPiece& out);
    bool read_piece_cells(std::size_t piece, VtkCells& cells);
    bool read_arrays(XmlSection section, std::size_t piece, std::size_t count, std::vector<FieldData>& out);
    bool read_array(const XmlArray& array, std::optional<std::size_t> count, std::vector<FieldData>& out);
    bool read_field_data();

    MeshBuilder builder_;
    Context& context_;
    VtkArrays kept_;
};

bool VtuReader::read_piece_cells(std::size_t piece, VtkCells& cells) {
    const std::size_t count = pieces_[piece].cells;
    if (count == 0) return cells.offsets.assign(1, 0), true;
    const XmlArray* types = find_array(XmlSection::cells, piece, "types");
    if (types == nullptr)
        return scanner_.fail_at(pieces_[piece].begin, "a piece without types", kDamagedFile);
    std::vector<std::int64_t> numbers, offsets;
    if (!read_integers(*types, count, 256, numbers)) return false;
    cells.types.assign(numbers.begin(), numbers.end());
    if (!read_rows(XmlSection::cells, piece, count, offsets, numbers)) return false;
    cells.offsets.assign(offsets.begin(), offsets.end());
    cells.connectivity.assign(numbers.begin(), numbers.end());
    return true;
}

bool VtuReader::read_array(const XmlArray& array, std::optional<std::size_t> count,
                           std::vector<FieldData>& out) {
    const FieldLocation location =
        array.section == XmlSection::point_data ? FieldLocation::point : FieldLocation::cell;
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

bool VtuReader::read_arrays(XmlSection section, std::size_t piece, std::size_t count,
                            std::vector<FieldData>& out) {
    for (const XmlArray& array : arrays_) {
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
    return read_points(piece, out.positions) && read_piece_cells(piece, out.cells) &&
           read_arrays(XmlSection::point_data, piece, count, out.point) &&
           read_arrays(XmlSection::cell_data, piece, pieces_[piece].cells, out.cell);
}

bool VtuReader::read_field_data() {
    for (const XmlArray& array : arrays_) {
        if (array.section != XmlSection::field_data) continue;
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
