#include "io/scalar.hpp"
#include "io/scanner.hpp"
#include "io/write_openfoam.hpp"
#include "io/writers.hpp"

#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <new>

namespace hexopt {

using namespace io_detail;

namespace {

Error write_error(const std::filesystem::path& path, std::string reason, std::string advice,
                  ErrorCode code = ErrorCode::output_failed) {
    return Error{code, "write", path.string(), {std::move(reason), std::move(advice)}};
}

bool holds(FieldType type, double value) {
    if (!is_integer(type)) return true;
    if (value != std::floor(value)) return false;
    switch (type) {
    case FieldType::uint8:
        return value >= 0 && value <= 255;
    case FieldType::int32:
        return value >= -2147483648.0 && value <= 2147483647.0;
    default:
        return value >= -kMostExactInteger && value <= kMostExactInteger;
    }
}

Status check_field(const std::filesystem::path& path, const FieldData& field, const HexMesh& mesh) {
    const std::size_t count =
        field.location == FieldLocation::point ? mesh.vertex_count() : mesh.cell_count();
    if (field.name.empty() || field.name.starts_with("hexopt_"))
        return write_error(path, fmt::format("'{}' cannot name an array", shown(field.name)),
                           "choose another name");
    if (field.components == 0 || field.values.size() != count * field.components)
        return write_error(path,
                           fmt::format("array {} has {} values, but {} times {} are needed",
                                       shown(field.name), field.values.size(), count, field.components),
                           "give one tuple for each vertex or cell");
    for (double value : field.values)
        if (!holds(field.type, value))
            return write_error(
                path, fmt::format("array {} holds {}, which its type does not", shown(field.name), value),
                "give it a wider type");
    return Done{};
}

Status check_mesh(const std::filesystem::path& path, const HexMesh& mesh) {
    for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(mesh.positions[v][k]))
                return write_error(path, fmt::format("vertex {} is not at a finite place", v),
                                   "report this as a bug");
    if (!mesh.level.empty() && mesh.level.size() != mesh.cell_count())
        return write_error(path, fmt::format("{} levels for {} cells", mesh.level.size(), mesh.cell_count()),
                           "give each cell a level or none");
    for (const BoundaryQuad& quad : mesh.boundary)
        if (quad.patch >= mesh.patch_names.size())
            return write_error(path, fmt::format("patch {} has no name", quad.patch), "name every patch");
    for (const std::string& name : mesh.patch_names)
        if (name.find('\0') != std::string::npos)
            return write_error(path, fmt::format("patch name '{}' holds a zero byte", shown(name)),
                               "choose another name");
    return Done{};
}

template <class Range>
FieldData field_of(const char* name, const Range& range, std::uint32_t components, FieldType type) {
    return {name, FieldLocation::cell, components, std::vector<double>(range.begin(), range.end()), type};
}

std::vector<FieldData> constraint_fields(const HexMesh& mesh) {
    std::vector<FieldData> fields;
    if (!mesh.hanging.empty()) {
        fields.push_back(field_of("hexopt_hanging_vertex", mesh.hanging.vertex, 1, FieldType::int64));
        fields.push_back(field_of("hexopt_hanging_offset", mesh.hanging.offset, 1, FieldType::int64));
        fields.push_back(field_of("hexopt_hanging_master", mesh.hanging.master, 1, FieldType::int64));
        fields.push_back(field_of("hexopt_hanging_weight", mesh.hanging.weight, 1, FieldType::float64));
    }
    if (!mesh.patch_names.empty()) {
        std::vector<Index> vertices, patches;
        for (const BoundaryQuad& quad : mesh.boundary) {
            vertices.insert(vertices.end(), quad.vertices.begin(), quad.vertices.end());
            patches.push_back(quad.patch);
        }
        fields.push_back(field_of("hexopt_boundary_quad", vertices, 4, FieldType::int64));
        fields.push_back(field_of("hexopt_boundary_patch", patches, 1, FieldType::int64));
    }
    return fields;
}

void select_fields(std::span<const FieldData> fields, MeshToWrite& content) {
    for (std::size_t i = 0; i < fields.size(); ++i) {
        const FieldData& field = fields[i];
        bool is_replaced =
            !content.level.values.empty() && field.location == FieldLocation::cell && field.name == "level";
        for (std::size_t k = i + 1; k < fields.size(); ++k)
            is_replaced =
                is_replaced || (fields[k].name == field.name && fields[k].location == field.location);
        if (!is_replaced)
            (field.location == FieldLocation::point ? content.point : content.cell).push_back(&field);
    }
}

void note_losses(const std::filesystem::path& path, const char* format, const MeshToWrite& content,
                 const Context& context) {
    for (const auto* fields : {&content.point, &content.cell})
        for (const FieldData* field : *fields)
            if (field->name != "medit:ref")
                context.log(LogLevel::info, fmt::format("{}: {} holds no arrays; {} is left out",
                                                        path.string(), format, shown(field->name)));
}

Status write_checked(const std::filesystem::path& path, const MeshToWrite& content, MeshFormat format,
                     const WriteOptions& options, Context& context) {
    Result<AtomicFile> file = AtomicFile::create(path, context);
    if (!file) return file.error();
    Status status = Done{};
    if (format == MeshFormat::vtu) {
        status = write_vtu(*file, content, options, context);
    } else if (format == MeshFormat::vtk) {
        status = write_legacy_vtk(*file, content, options.encoding != Encoding::text);
    } else {
        if (!content.mesh.hanging.empty())
            context.log(LogLevel::warning,
                        path.string() +
                            ": MEDIT holds no hanging constraints; they are recognised again by position");
        note_losses(path, "MEDIT", content, context);
        status = write_medit(*file, content);
    }
    return status ? file->commit() : status;
}

} // namespace

std::string io_detail::encode(const FieldData& field, std::endian order) {
    std::string bytes;
    const auto append_all = [&]<class T>(T) {
        bytes.reserve(field.values.size() * sizeof(T));
        for (double value : field.values) append_number(bytes, static_cast<T>(value), order);
    };
    switch (field.type) {
    case FieldType::float64:
        append_all(double{});
        break;
    case FieldType::float32:
        append_all(float{});
        break;
    case FieldType::int32:
        append_all(std::int32_t{});
        break;
    case FieldType::int64:
        append_all(std::int64_t{});
        break;
    case FieldType::uint8:
        append_all(std::uint8_t{});
        break;
    }
    return bytes;
}

Result<MeshFormat> format_of_name(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (extension == ".vtu") return MeshFormat::vtu;
    if (extension == ".vtk") return MeshFormat::vtk;
    if (extension == ".mesh") return MeshFormat::medit;
    if (!openfoam_folder(path).empty()) return MeshFormat::openfoam;
    return write_error(path, fmt::format("no format is known for '{}'", shown(extension)),
                       "name the file .vtu, .vtk, .mesh or .foam, or a folder polyMesh", ErrorCode::usage);
}

Result<MeshFormat> choose_format(const std::filesystem::path& path, const WriteOptions& options) {
    const Result<MeshFormat> format =
        options.format == MeshFormat::from_name ? format_of_name(path) : Result<MeshFormat>(options.format);
    if (!format) return format.error();
    if (*format == MeshFormat::vtu && options.encoding == Encoding::text)
        return write_error(path, "VTU is not written as text", "write .vtk as text instead",
                           ErrorCode::usage);
    if (*format == MeshFormat::medit && options.encoding == Encoding::binary)
        return write_error(path, "MEDIT is not written in binary", "write .vtu or .vtk instead",
                           ErrorCode::usage);
    if (*format != MeshFormat::vtu && options.polyhedra)
        return write_error(path, "only VTU is written with polyhedra", "write .vtu instead",
                           ErrorCode::usage);
    if (options.compression_level < 1 || options.compression_level > 9)
        return write_error(path, fmt::format("compression level {}", options.compression_level),
                           "give 1 to 9", ErrorCode::usage);
    return format;
}

Status write_mesh(const std::filesystem::path& path, const HexMesh& mesh, std::span<const FieldData> fields,
                  const WriteOptions& options, Context& context) {
    const Result<MeshFormat> format = choose_format(path, options);
    if (!format) return format.error();
    try {
        if (Status status = check_mesh(path, mesh); !status) return status;
        for (const FieldData& field : fields)
            if (Status status = check_field(path, field, mesh); !status) return status;
        MeshToWrite content{
            mesh, {}, {}, constraint_fields(mesh), field_of("level", mesh.level, 1, FieldType::uint8)};
        select_fields(fields, content);
        if (*format == MeshFormat::openfoam) {
            note_losses(path, "OpenFOAM's polyMesh", content, context);
            return write_openfoam(path, mesh, options.encoding, options.empty_patches, context);
        }
        return write_checked(path, content, *format, options, context);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "write", path.string(), "no memory to write this mesh");
    }
}

} // namespace hexopt
