#include "io/writers.hpp"

#include <fmt/format.h>
#include <limits>

namespace hexopt::io_detail {

namespace {

constexpr const char* kTypeNames[] = {"double", "float", "int", "vtktypeint64", "unsigned_char"};
constexpr std::endian kOrder = std::endian::big;

/// Names and strings must not hold white space, quotes or percent signs.
std::string percent_encoded(std::string_view text) {
    std::string out;
    for (char c : text) {
        if (c <= ' ' || c > '~' || c == '%' || c == '"')
            out += fmt::format("%{:02X}", static_cast<unsigned char>(c));
        else
            out += c;
    }
    return out;
}

/// The length in 1, 2, 4 or 8 bytes, which the two top bits tell, then the characters.
void append_string(std::string& bytes, std::string_view text) {
    const std::uint64_t length = text.size();
    if (length < 1u << 6)
        append_number(bytes, static_cast<std::uint8_t>(0xC0u | length), kOrder);
    else if (length < 1u << 14)
        append_number(bytes, static_cast<std::uint16_t>(0x8000u | length), kOrder);
    else if (length < 1u << 30)
        append_number(bytes, static_cast<std::uint32_t>(0x40000000u | length), kOrder);
    else
        append_number(bytes, length, kOrder);
    bytes += text;
}

class LegacyVtkWriter {
  public:
    LegacyVtkWriter(AtomicFile& file, bool is_binary) : out_(file), is_binary_(is_binary) {}
    Status write(const MeshToWrite& content);

  private:
    void write_points(const HexMesh& mesh);
    void write_cells(const HexMesh& mesh);
    void write_array(const FieldData& field);
    void write_patch_names(const std::vector<std::string>& names);
    void write_part(const char* keyword, std::size_t count, const std::vector<const FieldData*>& fields);

    TextWriter out_;
    bool is_binary_;
};

void LegacyVtkWriter::write_points(const HexMesh& mesh) {
    out_.text(fmt::format("POINTS {} double\n", mesh.vertex_count()));
    for (const Point& p : mesh.positions) {
        std::string bytes;
        for (int k = 0; k < 3; ++k) {
            if (is_binary_) {
                append_number(bytes, p[k], kOrder);
                continue;
            }
            out_.number(p[k]);
            out_.text(k == 2 ? "\n" : " ");
        }
        out_.text(bytes);
    }
    if (is_binary_) out_.text("\n");
}

void LegacyVtkWriter::write_cells(const HexMesh& mesh) {
    constexpr std::int32_t kHexahedron = 12;
    out_.text(fmt::format("CELLS {} {}\n", mesh.cell_count(), 9 * mesh.cell_count()));
    for (const Cell& cell : mesh.cells) {
        std::string bytes;
        append_number(bytes, std::int32_t{8}, kOrder);
        for (Index v : cell) append_number(bytes, static_cast<std::int32_t>(v), kOrder);
        out_.text(is_binary_ ? bytes : fmt::format("8 {}\n", fmt::join(cell, " ")));
    }
    out_.text(fmt::format("{}CELL_TYPES {}\n", is_binary_ ? "\n" : "", mesh.cell_count()));
    std::string type;
    if (is_binary_)
        append_number(type, kHexahedron, kOrder);
    else
        type = fmt::format("{}\n", kHexahedron);
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) out_.text(type);
    if (is_binary_) out_.text("\n");
}

void LegacyVtkWriter::write_array(const FieldData& field) {
    out_.text(fmt::format("{} {} {} {}\n", percent_encoded(field.name), field.components,
                          field.values.size() / field.components, kTypeNames[static_cast<int>(field.type)]));
    if (!is_binary_) return out_.array(field);
    out_.text(encode(field, kOrder));
    out_.text("\n");
}

void LegacyVtkWriter::write_patch_names(const std::vector<std::string>& names) {
    out_.text(fmt::format("hexopt_patch_name 1 {} string\n", names.size()));
    for (const std::string& name : names) {
        std::string bytes;
        if (is_binary_)
            append_string(bytes, name);
        else
            bytes = percent_encoded(name) + "\n";
        out_.text(bytes);
    }
    if (is_binary_) out_.text("\n");
}

void LegacyVtkWriter::write_part(const char* keyword, std::size_t count,
                                 const std::vector<const FieldData*>& fields) {
    if (fields.empty()) return;
    out_.text(fmt::format("{} {}\nFIELD FieldData {}\n", keyword, count, fields.size()));
    for (const FieldData* field : fields) write_array(*field);
}

Status LegacyVtkWriter::write(const MeshToWrite& content) {
    const HexMesh& mesh = content.mesh;
    out_.text(fmt::format("# vtk DataFile Version 3.0\nhexopt-gpu\n{}\nDATASET UNSTRUCTURED_GRID\n",
                          is_binary_ ? "BINARY" : "ASCII"));
    const bool has_patches = !mesh.patch_names.empty();
    if (!content.field.empty()) {
        out_.text(fmt::format("FIELD FieldData {}\n", content.field.size() + has_patches));
        for (const FieldData& field : content.field) write_array(field);
        if (has_patches) write_patch_names(mesh.patch_names);
    }
    write_points(mesh);
    write_cells(mesh);
    std::vector<const FieldData*> cell = content.cell;
    if (!content.level.values.empty()) cell.insert(cell.begin(), &content.level);
    write_part("CELL_DATA", mesh.cell_count(), cell);
    write_part("POINT_DATA", mesh.vertex_count(), content.point);
    return out_.finish();
}

} // namespace

Status write_legacy_vtk(AtomicFile& file, const MeshToWrite& content, bool is_binary) {
    constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
    if (content.mesh.vertex_count() > kMost || content.mesh.cell_count() > kMost / 9)
        return make_error(ErrorCode::output_failed, "write", "",
                          "legacy VTK counts with 32 bits, which are too few for this mesh; write .vtu");
    return LegacyVtkWriter(file, is_binary).write(content);
}

} // namespace hexopt::io_detail
