#include "io/vtk_cells.hpp"

#include "io/scalar.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <iterator>

namespace hexopt::io_detail {

namespace {

enum : std::uint8_t { kEmptyCell = 0, kPixel = 8, kQuad = 9, kVoxel = 11, kHexahedron = 12 };

constexpr std::array<int, 8> kVoxelToHexahedron = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::array<int, 4> kPixelToQuad = {0, 1, 3, 2};

struct TypeName {
    std::uint8_t type;
    bool has_volume;
    const char* name;
};

constexpr TypeName kTypeNames[] = {
    {1, false, "vertex"},
    {2, false, "poly-vertex"},
    {3, false, "line"},
    {4, false, "poly-line"},
    {5, false, "triangle"},
    {6, false, "triangle strip"},
    {7, false, "polygon"},
    {10, true, "tetrahedron"},
    {13, true, "wedge"},
    {14, true, "pyramid"},
    {15, true, "pentagonal prism"},
    {16, true, "hexagonal prism"},
    {21, false, "quadratic edge"},
    {22, false, "quadratic triangle"},
    {23, false, "quadratic quad"},
    {24, true, "quadratic tetrahedron"},
    {25, true, "quadratic hexahedron"},
    {26, true, "quadratic wedge"},
    {27, true, "quadratic pyramid"},
    {28, false, "biquadratic quad"},
    {29, true, "triquadratic hexahedron"},
    {36, false, "polygon"},
    {42, true, "polyhedron"},
    {68, false, "Lagrange curve"},
    {69, false, "Lagrange triangle"},
    {70, false, "Lagrange quad"},
    {71, true, "Lagrange tetrahedron"},
    {72, true, "Lagrange hexahedron"},
    {73, true, "Lagrange wedge"},
};

void count_other(MeshBuilder& builder, std::uint8_t type) {
    if (type == kEmptyCell) return;
    const auto found = std::find_if(std::begin(kTypeNames), std::end(kTypeNames),
                                    [&](const TypeName& t) { return t.type == type; });
    if (found == std::end(kTypeNames))
        ++builder.unsupported[fmt::format("cell of VTK type {}", type)];
    else
        ++(found->has_volume ? builder.unsupported : builder.ignored)[found->name];
}

FieldData select_tuples(FieldData&& field, const std::vector<Index>& rows) {
    std::vector<double> kept;
    kept.reserve(rows.size() * field.components);
    for (Index row : rows)
        for (std::uint32_t k = 0; k < field.components; ++k)
            kept.push_back(field.values[std::size_t{row} * field.components + k]);
    field.values = std::move(kept);
    return std::move(field);
}

Status bad_array(const MeshBuilder& builder, const std::string& name, const char* reason) {
    return Error{
        ErrorCode::bad_input,
        "read",
        builder.file,
        {fmt::format("array {} {}", name, reason), "remove the hexopt_ arrays or write the file again"}};
}

/// Whole numbers in [0, limit).
template <class T>
bool take_integers(const FieldData& field, double limit, std::vector<T>& out) {
    out.clear();
    out.reserve(field.values.size());
    for (double value : field.values) {
        if (!(value >= 0 && value < limit) || value != std::floor(value)) return false;
        out.push_back(static_cast<T>(value));
    }
    return true;
}

const FieldData* find_field(const std::vector<FieldData>& fields, std::string_view name) {
    const auto found =
        std::find_if(fields.begin(), fields.end(), [&](const FieldData& f) { return f.name == name; });
    return found == fields.end() ? nullptr : &*found;
}

Status add_hanging(MeshBuilder& builder, const std::vector<FieldData>& fields) {

    const FieldData* vertex = find_field(fields, "hexopt_hanging_vertex");
    const FieldData* offset = find_field(fields, "hexopt_hanging_offset");
    const FieldData* master = find_field(fields, "hexopt_hanging_master");
    const FieldData* weight = find_field(fields, "hexopt_hanging_weight");
    const int present = (vertex != nullptr) + (offset != nullptr) + (master != nullptr) + (weight != nullptr);
    if (present == 0) return Done{};
    if (present < 4)
        return bad_array(builder, "hexopt_hanging_*",
                         "is incomplete: _vertex, _offset, _master and _weight belong together");
    Hanging& hanging = builder.mesh.hanging;
    if (!take_integers(*vertex, kNoIndex, hanging.vertex))
        return bad_array(builder, vertex->name, "holds no vertex ids");
    if (!take_integers(*master, kNoIndex, hanging.master))
        return bad_array(builder, master->name, "holds no vertex ids");
    if (!take_integers(*offset, kMostExactInteger, hanging.offset) || hanging.offset.empty())
        return bad_array(builder, offset->name, "holds no offsets");
    hanging.weight = weight->values;
    return Done{};
}

Status add_named_patches(MeshBuilder& builder, const VtkArrays& arrays) {
    const FieldData* quad = find_field(arrays.field, "hexopt_boundary_quad");
    const FieldData* patch = find_field(arrays.field, "hexopt_boundary_patch");
    if (quad == nullptr && patch == nullptr) return Done{};
    std::vector<Index> vertices, patches;
    if (quad == nullptr || patch == nullptr || quad->values.size() != 4 * patch->values.size())
        return bad_array(builder, "hexopt_boundary_*",
                         "is incomplete: four vertices and a patch for each quad");
    if (!take_integers(*quad, kNoIndex, vertices))
        return bad_array(builder, quad->name, "holds no vertex ids");
    if (!take_integers(*patch, static_cast<double>(arrays.patch_names.size()), patches))
        return bad_array(builder, patch->name, "holds numbers that hexopt_patch_name does not name");
    std::vector<Index> number;
    for (const std::string& name : arrays.patch_names) number.push_back(builder.patch_of(name));
    for (std::size_t q = 0; q < patches.size(); ++q)
        builder.quads.push_back(
            {{vertices[4 * q], vertices[4 * q + 1], vertices[4 * q + 2], vertices[4 * q + 3]},
             number[patches[q]]});
    return Done{};
}

void name_patches_of_cells(MeshBuilder& builder, const std::vector<FieldData>& cell_fields,
                           const VtkCellMap& map) {
    if (map.quads.empty()) return;
    const FieldData* tag = nullptr;
    for (const char* name : {"patch", "gmsh:physical", "medit:ref", "CellEntityIds"}) {
        const FieldData* field = find_field(cell_fields, name);
        if (tag == nullptr && field != nullptr && field->components == 1 && is_integer(field->type))
            tag = field;
    }
    std::vector<double> tags(map.quads.size(), 0);
    if (tag != nullptr)
        for (std::size_t q = 0; q < tags.size(); ++q) tags[q] = tag->values[map.quads[q]];
    std::vector<double> sorted = tags;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (double value : sorted)
        builder.patch_of(tag == nullptr ? "boundary" : fmt::format("patch_{:.0f}", value));
    for (std::size_t q = 0; q < tags.size(); ++q)
        builder.quads[q].patch =
            static_cast<Index>(std::lower_bound(sorted.begin(), sorted.end(), tags[q]) - sorted.begin());
}

} // namespace

Status add_vtk_cells(MeshBuilder& builder, const VtkCells& cells, VtkCellMap& map, const Locate& locate) {
    builder.mesh.cells.reserve(cells.count());
    map.hexahedra.reserve(cells.count());
    for (std::size_t c = 0; c < cells.count(); ++c) {
        const std::uint8_t type = cells.types[c];
        const Index* ids = cells.connectivity.data() + cells.offsets[c];
        const std::uint64_t size = cells.offsets[c + 1] - cells.offsets[c];
        const bool is_hexahedron = type == kHexahedron || type == kVoxel;
        const bool is_quad = type == kQuad || type == kPixel;
        if (!is_hexahedron && !is_quad) {
            count_other(builder, type);
            continue;
        }
        if (size != (is_hexahedron ? 8u : 4u))
            return Error{ErrorCode::bad_input,
                         "read",
                         locate(c),
                         {fmt::format("cell {} is a {} with {} vertices", c,
                                      is_hexahedron ? "hexahedron" : "quadrilateral", size),
                          "the file is damaged; write or copy it again"}};
        if (is_hexahedron) {
            Cell cell;
            for (int k = 0; k < 8; ++k) cell[k] = ids[type == kVoxel ? kVoxelToHexahedron[k] : k];
            builder.mesh.cells.push_back(cell);
            map.hexahedra.push_back(static_cast<Index>(c));
        } else {
            Quad quad;
            for (int k = 0; k < 4; ++k) quad[k] = ids[type == kPixel ? kPixelToQuad[k] : k];
            builder.quads.push_back({quad, 0});
            map.quads.push_back(static_cast<Index>(c));
        }
    }
    return Done{};
}

Status add_vtk_arrays(MeshBuilder& builder, VtkArrays&& arrays, const VtkCellMap& map, std::size_t cell_count,
                      const Context& context) {
    name_patches_of_cells(builder, arrays.cell, map);
    if (Status status = add_hanging(builder, arrays.field); !status) return status;
    if (Status status = add_named_patches(builder, arrays); !status) return status;
    for (auto* fields : {&arrays.point, &arrays.cell})
        std::erase_if(*fields, [&](const FieldData& field) {
            if (!field.name.starts_with("hexopt_")) return false;
            context.log(LogLevel::warning, fmt::format("{}: array {} is left out: hexopt_ names are reserved",
                                                       builder.file, shown(field.name)));
            return true;
        });
    for (FieldData& field : arrays.point) builder.fields.push_back(std::move(field));
    for (FieldData& field : arrays.cell) {
        FieldData kept = map.hexahedra.size() == cell_count ? std::move(field)
                                                            : select_tuples(std::move(field), map.hexahedra);
        std::vector<std::uint8_t> level;
        const bool may_be_level = kept.name == "level" && kept.components == 1 && is_integer(kept.type);
        if (may_be_level && take_integers(kept, 256, level))
            builder.mesh.level = std::move(level);
        else
            builder.fields.push_back(std::move(kept));
    }
    for (const FieldData& field : arrays.field)
        if (!field.name.starts_with("hexopt_"))
            context.log(LogLevel::info,
                        fmt::format("{}: field array {} is left out", builder.file, shown(field.name)));
    return Done{};
}

} // namespace hexopt::io_detail
