#include "io/vtu_polyhedra.hpp"
#include "io/writers.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <zlib.h>

namespace hexopt::io_detail {

namespace {

constexpr const char* kTypeNames[] = {"Float64", "Float32", "Int32", "Int64", "UInt8"};
constexpr std::endian kOrder = std::endian::little;
constexpr std::size_t kBlockBytes = std::size_t{1} << 18;

std::string escaped(std::string_view text) {
    std::string out;
    for (char c : text) {
        switch (c) {
        case '&':
            out += "&amp;";
            break;
        case '<':
            out += "&lt;";
            break;
        case '>':
            out += "&gt;";
            break;
        case '"':
            out += "&quot;";
            break;
        default:
            out += static_cast<unsigned char>(c) < ' ' ? '_' : c; // XML has no other control characters
        }
    }
    return out;
}

/// VTK's compressed form: number of blocks, bytes of a block, bytes of the last one if it is shorter,
/// compressed bytes of each block, then the blocks.
Result<std::string> compressed(std::string_view bytes, int level, const Context& context) {
    const std::size_t block_count = (bytes.size() + kBlockBytes - 1) / kBlockBytes;
    std::vector<std::string> blocks(block_count);
    context.parallel().for_each(block_count, 1, [&](std::size_t b) {
        const std::string_view raw = bytes.substr(b * kBlockBytes, kBlockBytes);
        uLongf size = compressBound(raw.size());
        blocks[b].resize(size);
        const int code = compress2(reinterpret_cast<Bytef*>(blocks[b].data()), &size,
                                   reinterpret_cast<const Bytef*>(raw.data()), raw.size(), level);
        blocks[b].resize(code == Z_OK ? size : 0);
    });
    std::string out;
    append_number(out, std::uint64_t{block_count}, kOrder);
    append_number(out, std::uint64_t{kBlockBytes}, kOrder);
    append_number(out, std::uint64_t{bytes.size() % kBlockBytes}, kOrder);
    for (const std::string& block : blocks) {
        if (block.empty())
            return make_error(ErrorCode::out_of_memory, "write", "", "no memory to compress the mesh");
        append_number(out, std::uint64_t{block.size()}, kOrder);
    }
    for (const std::string& block : blocks) out += block;
    return out;
}

class VtuWriter {
  public:
    VtuWriter(const WriteOptions& options, const Context& context) : options_(options), context_(context) {}
    Status write(AtomicFile& file, const MeshToWrite& content);

  private:
    void add_array(const FieldData& field, bool with_tuples = false);
    void add_bytes(const std::string& attributes, const std::string& bytes);
    void add_points(const HexMesh& mesh);
    void add_cells(const HexMesh& mesh);
    void add_polyhedra(const HexMesh& mesh);
    void add_integers(const char* name, const std::vector<std::int64_t>& values);
    void add_field_data(const MeshToWrite& content);

    const WriteOptions& options_;
    const Context& context_;
    std::string xml_, appended_;
    Status status_ = Done{};
};

void VtuWriter::add_bytes(const std::string& attributes, const std::string& bytes) {
    xml_ += fmt::format("<DataArray {} format=\"appended\" offset=\"{}\"/>\n", attributes, appended_.size());
    if (!status_) return;
    Result<std::string> packed = compressed(bytes, options_.compression_level, context_);
    if (packed)
        appended_ += *packed;
    else
        status_ = packed.error();
}

void VtuWriter::add_array(const FieldData& field, bool with_tuples) {
    std::string attributes =
        fmt::format("type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\"",
                    kTypeNames[static_cast<int>(field.type)], escaped(field.name), field.components);
    if (with_tuples)
        attributes += fmt::format(" NumberOfTuples=\"{}\"", field.values.size() / field.components);
    add_bytes(attributes, encode(field, kOrder));
}

void VtuWriter::add_points(const HexMesh& mesh) {
    std::string bytes;
    bytes.reserve(mesh.vertex_count() * 3 * sizeof(double));
    for (const Point& p : mesh.positions)
        for (int k = 0; k < 3; ++k) append_number(bytes, p[k], kOrder);
    add_bytes("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", bytes);
}

void VtuWriter::add_cells(const HexMesh& mesh) {
    constexpr char kHexahedron = 12;
    const bool is_wide = mesh.vertex_count() > std::numeric_limits<std::int32_t>::max();
    std::string bytes;
    bytes.reserve(mesh.cell_count() * 8 * (is_wide ? 8 : 4));
    for (const Cell& cell : mesh.cells)
        for (Index v : cell)
            is_wide ? append_number(bytes, std::int64_t{v}, kOrder)
                    : append_number(bytes, static_cast<std::int32_t>(v), kOrder);
    add_bytes(fmt::format("type=\"{}\" Name=\"connectivity\"", is_wide ? "Int64" : "Int32"), bytes);
    bytes.clear();
    for (std::size_t c = 1; c <= mesh.cell_count(); ++c)
        append_number(bytes, static_cast<std::int64_t>(8 * c), kOrder);
    add_bytes("type=\"Int64\" Name=\"offsets\"", bytes);
    add_bytes("type=\"UInt8\" Name=\"types\"", std::string(mesh.cell_count(), kHexahedron));
}

void VtuWriter::add_integers(const char* name, const std::vector<std::int64_t>& values) {
    std::string bytes;
    bytes.reserve(values.size() * 8);
    for (std::int64_t value : values) append_number(bytes, value, kOrder);
    add_bytes(fmt::format("type=\"Int64\" Name=\"{}\"", name), bytes);
}

void VtuWriter::add_polyhedra(const HexMesh& mesh) {
    const Result<PolyhedralCells> cells = make_polyhedral_cells(mesh, context_);
    if (!cells) {
        if (status_) status_ = cells.error();
        return;
    }
    add_integers("connectivity", cells->connectivity);
    add_integers("offsets", cells->offsets);
    add_bytes("type=\"UInt8\" Name=\"types\"", cells->types);
    if (cells->faces.empty()) return;
    add_integers("faces", cells->faces);
    add_integers("faceoffsets", cells->face_offsets);
}

void VtuWriter::add_field_data(const MeshToWrite& content) {
    if (content.field.empty()) return;
    xml_ += "<FieldData>\n";
    for (const FieldData& field : content.field) add_array(field, true);
    if (const auto& names = content.mesh.patch_names; !names.empty()) {
        std::string bytes;
        for (const std::string& name : names) bytes.append(name.c_str(), name.size() + 1);
        add_bytes(
            fmt::format("type=\"String\" Name=\"hexopt_patch_name\" NumberOfTuples=\"{}\"", names.size()),
            bytes);
    }
    xml_ += "</FieldData>\n";
}

Status VtuWriter::write(AtomicFile& file, const MeshToWrite& content) {
    const HexMesh& mesh = content.mesh;
    xml_ = "<?xml version=\"1.0\"?>\n"
           "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
           "header_type=\"UInt64\" "
           "compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n";
    add_field_data(content);
    xml_ += fmt::format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<PointData>\n",
                        mesh.vertex_count(), mesh.cell_count());
    for (const FieldData* field : content.point) add_array(*field);
    xml_ += "</PointData>\n<CellData>\n";
    if (!content.level.values.empty()) add_array(content.level);
    for (const FieldData* field : content.cell) add_array(*field);
    xml_ += "</CellData>\n<Points>\n";
    add_points(mesh);
    xml_ += "</Points>\n<Cells>\n";
    options_.polyhedra ? add_polyhedra(mesh) : add_cells(mesh);
    xml_ += "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";
    if (!status_) return status_;
    if (Status status = file.write(xml_); !status) return status;
    if (Status status = file.write(appended_); !status) return status;
    return file.write("\n</AppendedData>\n</VTKFile>\n");
}

} // namespace

Status write_vtu(AtomicFile& file, const MeshToWrite& content, const WriteOptions& options,
                 Context& context) {
    return VtuWriter(options, context).write(file, content);
}

} // namespace hexopt::io_detail
