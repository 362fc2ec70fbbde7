#include "io/writers.hpp"

#include <algorithm>
#include <charconv>
#include <set>

namespace hexopt::io_detail {

namespace {

/// The values of the array "medit:ref", or zeros.
std::vector<std::int64_t> references(const std::vector<const FieldData*>& fields, std::size_t count) {
    std::vector<std::int64_t> out(count, 0);
    for (const FieldData* field : fields)
        if (field->name == "medit:ref" && field->components == 1 && field->type != FieldType::float64 &&
            field->type != FieldType::float32)
            std::transform(field->values.begin(), field->values.end(), out.begin(),
                           [](double value) { return static_cast<std::int64_t>(value); });
    return out;
}

bool parse_patch_number(std::string_view name, std::int64_t& number) {
    constexpr std::string_view kPrefix = "patch_";
    if (!name.starts_with(kPrefix)) return false;
    name.remove_prefix(kPrefix.size());
    const auto [end, code] = std::from_chars(name.data(), name.data() + name.size(), number);
    return code == std::errc() && end == name.data() + name.size();
}

/// Patches named patch_N, as the reader names them, keep N; the others get the smallest numbers that are
/// free.
std::vector<std::int64_t> patch_references(const std::vector<std::string>& names) {
    std::vector<std::int64_t> out(names.size());
    std::vector<bool> has_number(names.size());
    std::set<std::int64_t> taken;
    for (std::size_t p = 0; p < names.size(); ++p)
        has_number[p] = parse_patch_number(names[p], out[p]) && taken.insert(out[p]).second;
    std::int64_t next = 1;
    for (std::size_t p = 0; p < names.size(); ++p) {
        if (has_number[p]) continue;
        while (taken.count(next) > 0) ++next;
        out[p] = next++;
    }
    return out;
}

template <class Ids>
void write_item(TextWriter& out, const Ids& ids, std::int64_t reference) {
    for (Index id : ids) {
        out.number(std::int64_t{id} + 1);
        out.text(" ");
    }
    out.number(reference);
    out.text("\n");
}

} // namespace

Status write_medit(AtomicFile& file, const MeshToWrite& content) {
    const HexMesh& mesh = content.mesh;
    TextWriter out(file);
    const auto heading = [&](const char* keyword, std::size_t count) {
        out.text(keyword);
        out.number(static_cast<std::int64_t>(count));
        out.text("\n");
    };
    out.text("MeshVersionFormatted 2\nDimension 3\n");
    heading("Vertices\n", mesh.vertex_count());
    const std::vector<std::int64_t> vertex_references = references(content.point, mesh.vertex_count());
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
        for (int k = 0; k < 3; ++k) {
            out.number(mesh.positions[v][k]);
            out.text(" ");
        }
        out.number(vertex_references[v]);
        out.text("\n");
    }
    heading("Hexahedra\n", mesh.cell_count());
    const std::vector<std::int64_t> cell_references = references(content.cell, mesh.cell_count());
    for (std::size_t c = 0; c < mesh.cell_count(); ++c) write_item(out, mesh.cells[c], cell_references[c]);
    if (!mesh.boundary.empty()) {
        const std::vector<std::int64_t> quad_references = patch_references(mesh.patch_names);
        heading("Quadrilaterals\n", mesh.boundary.size());
        for (const BoundaryQuad& quad : mesh.boundary)
            write_item(out, quad.vertices, quad_references[quad.patch]);
    }
    out.text("End\n");
    return out.finish();
}

} // namespace hexopt::io_detail
