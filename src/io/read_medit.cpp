#include "io/mesh_builder.hpp"
#include "io/readers.hpp"
#include "io/scalar.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

constexpr char kComment = '#';

/// Elements whose items have a fixed number of integers; those that are not kept are counted.
struct Keyword {
    std::string_view name;
    int numbers;
    const char* element; ///< what one item is called, or nullptr where items are only marks
    bool has_volume;
};

constexpr Keyword kKeywords[] = {
    {"Edges", 3, "edge", false},
    {"Triangles", 4, "triangle", false},
    {"Tetrahedra", 5, "tetrahedron", true},
    {"Prisms", 7, "prism", true},
    {"Wedges", 7, "prism", true},
    {"Pyramids", 6, "pyramid", true},
    {"TetrahedraP2", 11, "quadratic tetrahedron", true},
    {"HexahedraQ2", 28, "quadratic hexahedron", true},
    {"Corners", 1, nullptr, false},
    {"Ridges", 1, nullptr, false},
    {"RequiredVertices", 1, nullptr, false},
    {"RequiredEdges", 1, nullptr, false},
    {"RequiredTriangles", 1, nullptr, false},
    {"RequiredQuadrilaterals", 1, nullptr, false},
};

class MeditReader {
  public:
    MeditReader(const std::string& file, std::string_view bytes, Context& context)
        : scanner_(file, bytes, kComment), builder_(file), context_(context) {
        builder_.first_id = 1;
    }

    Result<MeshFile> read();

  private:
    bool read_section(std::string_view keyword);
    bool read_vertices();
    bool read_hexahedra();
    bool read_quadrilaterals();
    bool read_ids(std::span<Index> ids);
    bool skip_items(const Keyword& keyword);
    bool skip_unknown(std::string_view keyword);
    void keep_references(FieldLocation location, std::vector<double>&& references);
    void name_patches();

    Scanner scanner_;
    MeshBuilder builder_;
    Context& context_;
    std::size_t vertices_start_ = 0, hexahedra_start_ = 0;
    std::vector<std::int64_t> quad_references_;
    bool has_vertices_ = false, has_hexahedra_ = false;
};

bool MeditReader::read_ids(std::span<Index> ids) {
    for (Index& out : ids) {
        std::int64_t id = 0;
        if (!scanner_.read_int(id)) return false;
        if (id == 0)
            return scanner_.fail("vertex id 0", "ids of this format start at 1; this file may count from 0");
        if (id < 0 || id >= kNoIndex)
            return scanner_.fail(fmt::format("vertex id {}", id),
                                 "the file is damaged; write or copy it again");
        out = static_cast<Index>(id - 1);
    }
    return true;
}

bool MeditReader::read_vertices() {
    constexpr std::size_t kLeastBytes = 8; // "0 0 0 0\n"
    std::size_t count = 0;
    if (!scanner_.read_count(count, "vertices", kLeastBytes)) return false;
    if (std::exchange(has_vertices_, true)) return scanner_.fail("a second list of vertices", "keep one");
    vertices_start_ = scanner_.position();
    builder_.mesh.positions.resize(count);
    std::vector<double> references(count);
    for (std::size_t v = 0; v < count; ++v) {
        Point& p = builder_.mesh.positions[v];
        std::int64_t reference = 0;
        if (!scanner_.read_double(p.x) || !scanner_.read_double(p.y) || !scanner_.read_double(p.z) ||
            !scanner_.read_int(reference))
            return false;
        references[v] = static_cast<double>(reference);
    }
    keep_references(FieldLocation::point, std::move(references));
    return true;
}

bool MeditReader::read_hexahedra() {
    constexpr std::size_t kLeastBytes = 18;
    std::size_t count = 0;
    if (!scanner_.read_count(count, "hexahedra", kLeastBytes)) return false;
    if (std::exchange(has_hexahedra_, true)) return scanner_.fail("a second list of hexahedra", "keep one");
    hexahedra_start_ = scanner_.position();
    builder_.mesh.cells.resize(count);
    std::vector<double> references(count);
    for (std::size_t c = 0; c < count; ++c) {
        std::int64_t reference = 0;
        if (!read_ids(builder_.mesh.cells[c]) || !scanner_.read_int(reference)) return false;
        references[c] = static_cast<double>(reference);
    }
    keep_references(FieldLocation::cell, std::move(references));
    return true;
}

bool MeditReader::read_quadrilaterals() {
    constexpr std::size_t kLeastBytes = 10;
    std::size_t count = 0;
    if (!scanner_.read_count(count, "quadrilaterals", kLeastBytes)) return false;
    for (std::size_t q = 0; q < count; ++q) {
        SourceQuad quad{};
        std::int64_t reference = 0;
        if (!read_ids(quad.vertices) || !scanner_.read_int(reference)) return false;
        builder_.quads.push_back(quad);
        quad_references_.push_back(reference);
    }
    return true;
}

void MeditReader::keep_references(FieldLocation location, std::vector<double>&& references) {
    constexpr double kMostInt32 = 2147483647.0;
    if (std::all_of(references.begin(), references.end(), [](double r) { return r == 0; })) return;
    if (std::any_of(references.begin(), references.end(),
                    [](double r) { return r > kMostInt32 || r < -kMostInt32; })) {
        context_.log(LogLevel::warning,
                     fmt::format("{}: references beyond 32 bits are left out", scanner_.file()));
        return;
    }
    builder_.fields.push_back({"medit:ref", location, 1, std::move(references), FieldType::int32});
}

/// Patches in the order of their references.
void MeditReader::name_patches() {
    std::vector<std::int64_t> sorted = quad_references_;
    std::sort(sorted.begin(), sorted.end());
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    for (std::int64_t reference : sorted) builder_.patch_of(fmt::format("patch_{}", reference));
    for (std::size_t q = 0; q < builder_.quads.size(); ++q)
        builder_.quads[q].patch = static_cast<Index>(
            std::lower_bound(sorted.begin(), sorted.end(), quad_references_[q]) - sorted.begin());
}

bool MeditReader::skip_items(const Keyword& keyword) {
    std::size_t count = 0;
    if (!scanner_.read_count(count, keyword.name.data(), static_cast<std::size_t>(2 * keyword.numbers)))
        return false;
    for (std::size_t i = 0; i < count * static_cast<std::size_t>(keyword.numbers); ++i) {
        std::int64_t ignored = 0;
        if (!scanner_.read_int(ignored)) return false;
    }
    if (keyword.element != nullptr && count > 0)
        (keyword.has_volume ? builder_.unsupported : builder_.ignored)[keyword.element] += count;
    return true;
}

/// A keyword of another program: numbers up to the next word belong to it.
bool MeditReader::skip_unknown(std::string_view keyword) {
    const bool is_word = std::isupper(static_cast<unsigned char>(keyword[0])) &&
                         std::all_of(keyword.begin(), keyword.end(),
                                     [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!is_word)
        return scanner_.fail(fmt::format("'{}' stands where a keyword should", shown(keyword)),
                             "the file is damaged or a count before this place is wrong");
    context_.log(LogLevel::warning, fmt::format("{}: section {} is left out",
                                                scanner_.place(scanner_.position()), shown(keyword)));
    for (std::string_view next = scanner_.peek(); !next.empty(); next = scanner_.peek()) {
        double ignored = 0;
        if (std::isalpha(static_cast<unsigned char>(next[0]))) break;
        if (!scanner_.read_double(ignored)) return false;
    }
    return true;
}

bool MeditReader::read_section(std::string_view keyword) {
    if (keyword == "MeshVersionFormatted" || keyword == "Dimension") {
        std::int64_t value = 0;
        if (!scanner_.read_int(value)) return false;
        if (keyword == "Dimension" && value != 3)
            return scanner_.fail(fmt::format("dimension {}", value), "give a mesh in three dimensions");
        return true;
    }
    if (keyword == "Vertices") return read_vertices();
    if (keyword == "Hexahedra") return read_hexahedra();
    if (keyword == "Quadrilaterals") return read_quadrilaterals();
    for (const Keyword& known : kKeywords)
        if (keyword == known.name) return skip_items(known);
    return skip_unknown(keyword);
}

Result<MeshFile> MeditReader::read() {
    std::string_view keyword;
    while (!(keyword = scanner_.token()).empty() && keyword != "End")
        if (!read_section(keyword)) return scanner_.error();
    if (!scanner_.ok()) return scanner_.error();
    if (keyword != "End")
        context_.log(
            LogLevel::warning,
            fmt::format("{}: the keyword End is missing; the file may be cut short", scanner_.file()));
    name_patches();
    const auto locate = [&](std::size_t start, std::size_t numbers) {
        return [this, start, numbers](std::size_t item) {
            return scanner_.place(scanner_.find_token(start, item * numbers));
        };
    };
    return builder_.finish(locate(vertices_start_, 4), locate(hexahedra_start_, 9), context_);
}

} // namespace

bool looks_like_medit(std::string_view bytes) {
    Scanner scanner("", bytes.substr(0, 65536), kComment);
    return scanner.token().starts_with("MeshVersionFormatted");
}

/// The number 1, whose byte order tells that of the file, and a version.
bool looks_like_binary_medit(std::string_view bytes) {
    if (bytes.size() < 8) return false;
    for (std::endian order : {std::endian::little, std::endian::big}) {
        const auto version = load<std::int32_t>(bytes.data() + 4, order);
        if (load<std::int32_t>(bytes.data(), order) == 1 && version >= 1 && version <= 4) return true;
    }
    return false;
}

Result<MeshFile> read_medit(const std::string& file, std::string_view bytes, Context& context) {
    return MeditReader(file, bytes, context).read();
}

} // namespace hexopt::io_detail
