#include "io/read_surface.hpp"

#include "io/cad_format.hpp"
#include "io/file_bytes.hpp"
#include "io/surface_readers.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <new>

namespace hexopt {

using namespace io_detail;

namespace {

Error bad(const std::string& file, std::string reason, std::string advice) {
    return Error{ErrorCode::bad_input, "read", file, {std::move(reason), std::move(advice)}};
}

bool has_extension(const std::string& file, std::string_view wanted) {
    std::string extension = std::filesystem::path(file).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension == wanted;
}

using Reader = bool (*)(Scanner&, SurfaceBuilder&);

Reader choose_reader(const std::string& file, std::string_view bytes) {
    if (looks_like_ply(bytes)) return read_ply;
    if (looks_like_off(bytes)) return read_off;
    if (looks_like_vtp(bytes)) return read_vtp;
    if (looks_like_binary_stl(bytes)) return read_binary_stl;
    if (looks_like_ascii_stl(bytes)) return read_ascii_stl;
    if (looks_like_obj(bytes) || has_extension(file, ".obj")) return read_obj;
    if (has_extension(file, ".stl")) return read_binary_stl; // which says what is wrong with its size
    return nullptr;
}

Status check(const std::string& file, const TriangleSoup& soup) {
    if (soup.triangles.empty()) return bad(file, "holds no triangles", "give a surface with faces");
    for (std::size_t v = 0; v < soup.vertices.size(); ++v)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(soup.vertices[v][k]))
                return bad(
                    file,
                    fmt::format("vertex {} (from 0) has {} coordinate {}", v, "xyz"[k], soup.vertices[v][k]),
                    "give finite coordinates");
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
        for (Index v : soup.triangles[t])
            if (v >= soup.vertices.size())
                return bad(
                    file,
                    fmt::format("triangle {} (from 0) uses vertex {} of {}", t, v, soup.vertices.size()),
                    "the file is damaged; write or copy it again");
    return Done{};
}

/// Drops patches without triangles.
void compact_patches(TriangleSoup& soup) {
    std::vector<Index> renumbered(soup.patch_names.size(), kNoIndex);
    for (Index patch : soup.patch) renumbered[patch] = 0;
    std::vector<std::string> names;
    for (std::size_t p = 0; p < renumbered.size(); ++p) {
        if (renumbered[p] == kNoIndex) continue;
        renumbered[p] = static_cast<Index>(names.size());
        names.push_back(std::move(soup.patch_names[p]));
    }
    soup.patch_names = std::move(names);
    for (Index& patch : soup.patch) patch = renumbered[patch];
}

} // namespace

Index SurfaceBuilder::patch_of(const std::string& name) {
    const auto [entry, is_new] = patch_number_.try_emplace(name, static_cast<Index>(soup.patch_names.size()));
    if (is_new) soup.patch_names.push_back(name);
    return entry->second;
}

void SurfaceBuilder::add_polygon(std::span<const Index> ids) {
    for (std::size_t i = 2; i < ids.size(); ++i) {
        soup.triangles.push_back({ids[0], ids[i - 1], ids[i]});
        soup.patch.push_back(patch);
    }
}

bool io_detail::take_id(Scanner& scanner, std::int64_t value, Index& id) {
    if (value < 0 || value >= kNoIndex)
        return scanner.fail(fmt::format("vertex id {}", value),
                            "the file is damaged; write or copy it again");
    id = static_cast<Index>(value);
    return true;
}

Result<TriangleSoup> io_detail::read_surface_bytes(const std::string& file, std::string_view bytes,
                                                   const Context& context,
                                                   const TessellationOptions& tessellation) {
    if (recognise_cad(file, bytes) != CadFormat::none) {
        Result<CadSurface> cad = read_cad_bytes(file, bytes, tessellation, context);
        if (!cad) return cad.error();
        if (Status status = check(file, cad->soup); !status) return status.error();
        return std::move(cad->soup);
    }
    const Reader reader = choose_reader(file, bytes);
    if (reader == nullptr)
        return bad(file, "no surface format that is known",
                   "give STL, OBJ, OFF, PLY, VTP, STEP, IGES or BREP");
    Scanner scanner(file, bytes);
    SurfaceBuilder builder(context);
    if (!reader(scanner, builder) || !scanner.ok()) return scanner.error();
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "read", file, "cancelled while reading");
    if (Status status = check(file, builder.soup); !status) return status.error();
    compact_patches(builder.soup);
    return std::move(builder.soup);
}

Result<TriangleSoup> read_surface(const std::filesystem::path& path, Context& context) {
    return read_surface(path, TessellationOptions{}, context);
}

Result<TriangleSoup> read_surface(const std::filesystem::path& path, const TessellationOptions& tessellation,
                                  Context& context) {
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return read_surface_bytes(path.string(), bytes->view(), context, tessellation);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for this surface");
    }
}

} // namespace hexopt
