#include "pipeline/quality_fields.hpp"

#include "quality/cell_quality.hpp"

namespace hexopt {

namespace {

constexpr std::size_t kCellChunk = 1024;

/// Each value exact in the type that it is stored in.
double as_float(double value) { return static_cast<double>(static_cast<float>(value)); }

} // namespace

void add_quality_fields(std::vector<FieldData>& fields, const std::filesystem::path& output,
                        const HexMesh& mesh, const Parallel& parallel) {
    const Result<MeshFormat> format = format_of_name(output);
    if (!format || (*format != MeshFormat::vtu && *format != MeshFormat::vtk)) return;
    const std::size_t count = mesh.cell_count();
    std::vector<double> jacobian(count), dihedral(count), valid(count);
    parallel.for_each(count, kCellChunk, [&](std::size_t c) {
        const CellQuality quality = compute_cell_quality(cell_points(mesh, c));
        jacobian[c] = as_float(quality.validity.scaled_jacobian);
        dihedral[c] = as_float(quality.min_dihedral);
        valid[c] = quality.validity.is_usable();
    });
    const auto add = [&](const char* name, std::vector<double> values, FieldType type) {
        fields.push_back({name, FieldLocation::cell, 1, std::move(values), type});
    };
    add("scaled_jacobian", std::move(jacobian), FieldType::float32);
    add("min_dihedral", std::move(dihedral), FieldType::float32);
    add("valid", std::move(valid), FieldType::uint8);
}

} // namespace hexopt
