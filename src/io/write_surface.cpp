#include "io/write_surface.hpp"

#include "io/scanner.hpp"
#include "io/writers.hpp"

#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

using io_detail::TextWriter;

Error write_error(const std::filesystem::path& path, std::string reason, std::string advice,
                  ErrorCode code = ErrorCode::output_failed) {
    return Error{code, "write", path.string(), {std::move(reason), std::move(advice)}};
}

std::string extension_of(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

Status check(const std::filesystem::path& path, const TriangleSoup& soup) {
    for (std::size_t v = 0; v < soup.vertices.size(); ++v)
        for (int k = 0; k < 3; ++k)
            if (!std::isfinite(soup.vertices[v][k]))
                return write_error(path, fmt::format("vertex {} is not at a finite place", v),
                                   "report this as a bug");
    if (!soup.patch.empty() && soup.patch.size() != soup.triangles.size())
        return write_error(
            path, fmt::format("{} patches for {} triangles", soup.patch.size(), soup.triangles.size()),
            "give each triangle a patch or none");
    for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
        for (Index v : soup.triangles[t])
            if (v >= soup.vertices.size())
                return write_error(path, fmt::format("triangle {} uses vertex {}", t, v),
                                   "report this as a bug");
        if (!soup.patch.empty() && soup.patch[t] >= soup.patch_names.size())
            return write_error(path, fmt::format("patch {} has no name", soup.patch[t]), "name every patch");
    }
    return Done{};
}

std::string printable(const std::string& name) {
    std::string out = name;
    for (char& c : out)
        if (static_cast<unsigned char>(c) < ' ') c = '_';
    return out;
}

struct NamedTriangles {
    std::string name;
    std::vector<std::size_t> triangles;
};

std::vector<NamedTriangles> group_by_patch(const TriangleSoup& soup) {
    std::vector<NamedTriangles> groups;
    for (const std::string& name : soup.patch_names) groups.push_back({printable(name), {}});
    if (soup.patch.empty()) groups.assign(1, {"surface", {}});
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
        groups[soup.patch.empty() ? 0 : soup.patch[t]].triangles.push_back(t);
    return groups;
}

/// Unit normal; zero where the triangle is degenerate, as STL's readers expect.
Point normal_of(const TriangleSoup& soup, std::size_t t) {
    const auto& [a, b, c] = soup.triangles[t];
    const Point n = glm::cross(soup.vertices[b] - soup.vertices[a], soup.vertices[c] - soup.vertices[a]);
    const double length = glm::length(n);
    return length > 0 ? n / length : Point(0);
}

void write_point(TextWriter& out, const char* keyword, const Point& p) {
    out.text(keyword);
    for (int k = 0; k < 3; ++k) {
        out.text(" ");
        out.number(p[k]);
    }
    out.text("\n");
}

Status write_text_stl(AtomicFile& file, const TriangleSoup& soup) {
    TextWriter out(file);
    for (const NamedTriangles& group : group_by_patch(soup)) {
        out.text("solid " + group.name + "\n");
        for (std::size_t t : group.triangles) {
            write_point(out, " facet normal", normal_of(soup, t));
            out.text("  outer loop\n");
            for (Index v : soup.triangles[t]) write_point(out, "   vertex", soup.vertices[v]);
            out.text("  endloop\n endfacet\n");
        }
        out.text("endsolid " + group.name + "\n");
    }
    return out.finish();
}

Status write_binary_stl(AtomicFile& file, const TriangleSoup& soup) {
    std::string bytes = "hexopt-gpu surface";
    bytes.resize(80, ' ');
    const auto append = [&bytes](const Point& p) {
        for (int k = 0; k < 3; ++k)
            io_detail::append_number(bytes, static_cast<float>(p[k]), std::endian::little);
    };
    io_detail::append_number(bytes, static_cast<std::uint32_t>(soup.triangles.size()), std::endian::little);
    for (const NamedTriangles& group : group_by_patch(soup))
        for (std::size_t t : group.triangles) {
            append(normal_of(soup, t));
            for (Index v : soup.triangles[t]) append(soup.vertices[v]);
            bytes.append(2, '\0');
        }
    return file.write(bytes);
}

Status write_obj(AtomicFile& file, const TriangleSoup& soup) {
    TextWriter out(file);
    for (const Point& p : soup.vertices) write_point(out, "v", p);
    for (const NamedTriangles& group : group_by_patch(soup)) {
        out.text("g " + group.name + "\n");
        for (std::size_t t : group.triangles) {
            out.text("f");
            for (Index v : soup.triangles[t]) {
                out.text(" ");
                out.number(std::int64_t{v} + 1);
            }
            out.text("\n");
        }
    }
    return out.finish();
}

} // namespace

bool is_surface_name(const std::filesystem::path& path) {
    const std::string extension = extension_of(path);
    return extension == ".stl" || extension == ".obj";
}

Status write_surface(const std::filesystem::path& path, const TriangleSoup& surface,
                     const WriteSurfaceOptions& options, Context& context) {
    const bool is_obj = extension_of(path) == ".obj";
    if (!is_surface_name(path))
        return write_error(
            path, fmt::format("no surface format is known for '{}'", io_detail::shown(extension_of(path))),
            "name the file .stl or .obj", ErrorCode::usage);
    if (is_obj && options.binary)
        return write_error(path, "OBJ is text", "write .stl in binary", ErrorCode::usage);
    if (Status status = check(path, surface); !status) return status;
    if (options.binary && surface.patch_names.size() > 1)
        context.log(LogLevel::warning, fmt::format("{}: binary STL holds no patches; {} names are left out",
                                                   path.string(), surface.patch_names.size()));
    Result<AtomicFile> file = AtomicFile::create(path, context);
    if (!file) return file.error();
    const Status status = is_obj           ? write_obj(*file, surface)
                          : options.binary ? write_binary_stl(*file, surface)
                                           : write_text_stl(*file, surface);
    return status ? file->commit() : status;
}

} // namespace hexopt
