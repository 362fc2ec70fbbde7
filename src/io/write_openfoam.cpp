#include "io/write_openfoam.hpp"

#include "io/atomic_folder.hpp"
#include "io/writers.hpp"
#include "mesh/polyhedral_faces.hpp"
#include "mesh/topology.hpp"

#include <algorithm>
#include <cctype>
#include <fmt/format.h>
#include <limits>
#include <set>

namespace hexopt {

namespace {

namespace fs = std::filesystem;
using io_detail::TextWriter;

/// What OpenFOAM's own tools put into a polyMesh; of an earlier mesh, so of no use with this one.
const std::set<std::string>& mesh_files() {
    static const std::set<std::string> names = [] {
        std::set<std::string> all = {"sets"};
        for (const char* name :
             {"points", "faces", "owner", "neighbour", "boundary", "cellLevel", "pointLevel", "level0Edge",
              "surfaceIndex", "refinementHistory", "cellZones", "faceZones", "pointZones", "meshModifiers",
              "parallelData", "pointProcAddressing", "faceProcAddressing", "cellProcAddressing",
              "boundaryProcAddressing"})
            for (const char* suffix : {"", ".gz", ".orig"}) all.insert(std::string(name) + suffix);
        return all;
    }();
    return names;
}

/// A patch name as one of OpenFOAM's words, different from those before.
std::string make_word(const std::string& name, std::set<std::string>& taken) {
    const bool needs_letter = !name.empty() && std::isdigit(static_cast<unsigned char>(name.front()));
    std::string word(needs_letter ? 1 : 0, '_');
    for (char c : name) {
        const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) ||
                              std::string_view("_-.+").find(c) != std::string_view::npos;
        word += is_plain ? c : '_';
    }
    if (word.empty()) word = "patch";
    std::string unique = word;
    for (int n = 2; !taken.insert(unique).second; ++n) unique = fmt::format("{}_{}", word, n);
    return unique;
}

class PolyMeshWriter {
  public:
    PolyMeshWriter(const fs::path& folder, const HexMesh& mesh, const PolyhedralFaces& faces, bool is_binary,
                   std::span<const std::string> empty_patches, const Context& context)
        : folder_(folder), mesh_(mesh), faces_(faces), is_binary_(is_binary), empty_patches_(empty_patches),
          context_(context) {}

    Status write() {
        if (Status status = write_points(); !status) return status;
        if (Status status = write_faces(); !status) return status;
        if (Status status = write_labels("owner", faces_.owner, note()); !status) return status;
        if (Status status = write_labels("neighbour", faces_.neighbour, note()); !status) return status;
        if (Status status = write_boundary(); !status) return status;
        return mesh_.level.empty() ? Status(Done{}) : write_levels();
    }

  private:
    template <class Body>
    Status write_file(const char* name, const char* type, const std::string& note, bool is_binary,
                      const Body& body) {
        Result<AtomicFile> file = AtomicFile::create(folder_ / name, context_);
        if (!file) return file.error();
        TextWriter out(*file);
        out.text(fmt::format("FoamFile\n{{\n    version     2.0;\n    format      {};\n    class       {};\n",
                             is_binary ? "binary" : "ascii", type));
        if (is_binary)
            out.text(fmt::format("    arch        \"{};label=32;scalar=64\";\n",
                                 std::endian::native == std::endian::little ? "LSB" : "MSB"));
        if (!note.empty()) out.text(fmt::format("    note        \"{}\";\n", note));
        out.text(fmt::format("    location    \"constant/polyMesh\";\n    object      {};\n}}\n\n", name));
        body(out);
        out.text("\n");
        if (Status status = out.finish(); !status) return status;
        return file->commit();
    }

    std::string note() const {
        return fmt::format("nPoints:{} nCells:{} nFaces:{} nInternalFaces:{}", mesh_.vertex_count(),
                           mesh_.cell_count(), faces_.count(), faces_.internal_count());
    }

    template <class T>
    void list(TextWriter& out, std::size_t count, const T& value_at) const {
        out.number(static_cast<std::int64_t>(count));
        if (count == 0 && is_binary_) return out.text("\n"); // as OpenFOAM writes it
        out.text("\n(");
        std::string raw;
        for (std::size_t i = 0; i < count; ++i) {
            if (is_binary_) {
                raw.clear();
                io_detail::append_number(raw, static_cast<std::int32_t>(value_at(i)), std::endian::native);
                out.text(raw);
            } else {
                out.text("\n");
                out.number(static_cast<std::int64_t>(value_at(i)));
            }
        }
        out.text(is_binary_ ? ")\n" : "\n)\n");
    }

    template <class T>
    Status write_labels(const char* name, const std::vector<T>& values, const std::string& note) {
        return write_file(name, "labelList", note, is_binary_, [&](TextWriter& out) {
            list(out, values.size(), [&](std::size_t i) { return values[i]; });
        });
    }

    Status write_points() {
        return write_file("points", "vectorField", "", is_binary_, [&](TextWriter& out) {
            out.number(static_cast<std::int64_t>(mesh_.vertex_count()));
            out.text("\n(");
            for (const Point& p : mesh_.positions) write_point(out, p);
            out.text(is_binary_ ? ")\n" : "\n)\n");
        });
    }

    void write_point(TextWriter& out, const Point& p) const {
        if (is_binary_) {
            std::string raw;
            for (int k = 0; k < 3; ++k) io_detail::append_number(raw, p[k], std::endian::native);
            return out.text(raw);
        }
        for (int k = 0; k < 3; ++k) {
            out.text(k == 0 ? "\n(" : " ");
            out.number(p[k]);
        }
        out.text(")");
    }

    Status write_faces() {
        const Csr<Index>& polygons = faces_.vertices;
        if (is_binary_)
            return write_file("faces", "faceCompactList", "", true, [&](TextWriter& out) {
                list(out, polygons.offset.size(), [&](std::size_t i) { return polygons.offset[i]; });
                list(out, polygons.item.size(), [&](std::size_t i) { return polygons.item[i]; });
            });
        return write_file("faces", "faceList", "", false, [&](TextWriter& out) {
            out.number(static_cast<std::int64_t>(polygons.rows()));
            out.text("\n(");
            for (std::size_t f = 0; f < polygons.rows(); ++f) {
                out.text("\n");
                out.number(static_cast<std::int64_t>(polygons[f].size()));
                const char* separator = "(";
                for (Index v : polygons[f]) {
                    out.text(separator);
                    out.number(std::int64_t{v});
                    separator = " ";
                }
                out.text(")");
            }
            out.text("\n)\n");
        });
    }

    bool is_empty(std::size_t patch) const {
        return std::find(empty_patches_.begin(), empty_patches_.end(), faces_.patch_names[patch]) !=
               empty_patches_.end();
    }

    Status write_boundary() {
        return write_file("boundary", "polyBoundaryMesh", "", false, [&](TextWriter& out) {
            const auto& start = faces_.patch_start;
            const std::size_t count = faces_.patch_names.size();
            out.text(fmt::format("{}\n(\n", count));
            std::set<std::string> taken;
            for (std::size_t p = 0; p < count; ++p)
                out.text(
                    fmt::format("    {}\n    {{\n        type            {};\n        nFaces          {};\n"
                                "        startFace       {};\n    }}\n",
                                make_word(faces_.patch_names[p], taken), is_empty(p) ? "empty" : "patch",
                                start[p + 1] - start[p], start[p]));
            out.text(")\n");
        });
    }

    /// A point has the level of the coarsest cell that it is a corner of: at most that of every cell it is a
    /// corner of, above that of a cell on whose edge or face it hangs.
    Status write_levels() {
        if (Status status = write_labels("cellLevel", mesh_.level, ""); !status) return status;
        constexpr std::uint8_t kNone = 255;
        std::vector<std::uint8_t> level(mesh_.vertex_count(), kNone);
        for (std::size_t c = 0; c < mesh_.cell_count(); ++c)
            for (Index v : mesh_.cells[c]) level[v] = std::min(level[v], mesh_.level[c]);
        std::replace(level.begin(), level.end(), kNone, std::uint8_t{0});
        return write_labels("pointLevel", level, "");
    }

    const fs::path& folder_;
    const HexMesh& mesh_;
    const PolyhedralFaces& faces_;
    bool is_binary_;
    std::span<const std::string> empty_patches_;
    const Context& context_;
};

Status write_folder(const fs::path& target, const HexMesh& mesh, bool is_binary,
                    std::span<const std::string> empty_patches, Context& context) {
    const Topology topology = compute_topology(mesh, context.parallel());
    const Result<PolyhedralFaces> faces = compute_polyhedral_faces(mesh, topology, context.parallel());
    if (!faces) return faces.error();
    if (faces->vertices.item.size() > std::numeric_limits<std::int32_t>::max())
        return Error{ErrorCode::output_failed,
                     "write",
                     target.string(),
                     {"too many faces for OpenFOAM's 32-bit labels", "write .vtu instead"}};
    Result<AtomicFolder> folder = AtomicFolder::create(target, mesh_files(), context);
    if (!folder) return folder.error();
    PolyMeshWriter writer(folder->path(), mesh, *faces, is_binary, empty_patches, context);
    if (Status status = writer.write(); !status) return status;
    return folder->commit();
}

} // namespace

fs::path openfoam_folder(const fs::path& path) {
    const fs::path plain = path.has_filename() ? path : path.parent_path();
    if (plain.filename() == "polyMesh") return plain;
    if (plain.extension() == ".foam") return plain.parent_path() / "constant" / "polyMesh";
    return {};
}

Status check_openfoam_folder(const fs::path& path) {
    return AtomicFolder::check(openfoam_folder(path), mesh_files());
}

Status write_openfoam(const fs::path& path, const HexMesh& mesh, Encoding encoding,
                      std::span<const std::string> empty_patches, Context& context) {
    const fs::path target = openfoam_folder(path);
    try {
        if (target != path && path.extension() == ".foam") {
            std::error_code error;
            fs::create_directories(target.parent_path(), error);
            if (error)
                return make_error(ErrorCode::output_failed, "write", target.parent_path().string(),
                                  "cannot create this folder: " + error.message());
        }
        if (Status status = write_folder(target, mesh, encoding != Encoding::text, empty_patches, context);
            !status)
            return status;
        return path.extension() == ".foam" ? write_atomically(path, "", context) : Status(Done{});
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "write", path.string(), "no memory to write this mesh");
    }
}

} // namespace hexopt
