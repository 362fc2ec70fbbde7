#include "io/point_hash.hpp"
#include "io/scalar.hpp"
#include "io/surface_readers.hpp"

#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <unordered_map>

namespace hexopt::io_detail {

namespace {

constexpr std::size_t kHeaderBytes = 80, kFacetBytes = 50;

/// Number of facets that a binary STL announces.
std::uint32_t announced_count(std::string_view bytes) {
    return load<std::uint32_t>(bytes.data() + kHeaderBytes, std::endian::little);
}

class Welder {
  public:
    explicit Welder(std::vector<Point>& vertices) : vertices_(vertices) {}
    Index operator()(const Point& p) {
        const auto [entry, is_new] = number_.try_emplace(p, static_cast<Index>(vertices_.size()));
        if (is_new) vertices_.push_back(p);
        return entry->second;
    }

  private:
    std::vector<Point>& vertices_;
    std::unordered_map<Point, Index, PointHash> number_;
};

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

bool expect(Scanner& scanner, std::string_view word) {
    const std::string_view token = scanner.token();
    if (lower(token) == word) return true;
    return scanner.fail(fmt::format("'{}' stands where {} should", shown(token), word),
                        "the file is damaged or cut short; write or copy it again");
}

bool read_facet(Scanner& scanner, SurfaceBuilder& builder, Welder& weld) {
    double ignored = 0;
    if (!expect(scanner, "normal")) return false;
    for (int k = 0; k < 3; ++k)
        if (!scanner.read_double(ignored)) return false;
    if (!expect(scanner, "outer") || !expect(scanner, "loop")) return false;
    std::array<Index, 3> triangle;
    for (Index& v : triangle) {
        Point p;
        if (!expect(scanner, "vertex")) return false;
        for (int k = 0; k < 3; ++k) {
            if (!scanner.read_double(p[k])) return false;
            if (!std::isfinite(p[k]))
                return scanner.fail(fmt::format("coordinate {}", p[k]), "give finite coordinates");
        }
        v = weld(p);
    }
    builder.add_polygon(triangle);
    return expect(scanner, "endloop") && expect(scanner, "endfacet");
}

} // namespace

bool looks_like_binary_stl(std::string_view bytes) {
    return bytes.size() >= kHeaderBytes + 4 &&
           bytes.size() == kHeaderBytes + 4 + kFacetBytes * std::size_t{announced_count(bytes)};
}

bool looks_like_ascii_stl(std::string_view bytes) {
    Scanner scanner("", bytes.substr(0, 1024));
    return lower(scanner.token()) == "solid";
}

bool read_binary_stl(Scanner& scanner, SurfaceBuilder& builder) {
    scanner.set_binary();
    const std::string_view bytes = scanner.bytes();
    if (bytes.size() < kHeaderBytes + 4)
        return scanner.fail_at(bytes.size(), fmt::format("a binary STL of {} bytes", bytes.size()),
                               "it is cut short");
    const std::size_t count = announced_count(bytes);
    scanner.seek(kHeaderBytes + 4);
    if (count > scanner.remaining() / kFacetBytes)
        return scanner.fail_at(kHeaderBytes,
                               fmt::format("announces {} triangles, but {} bytes follow, enough for {}",
                                           count, scanner.remaining(), scanner.remaining() / kFacetBytes),
                               "the file is cut short or damaged; write or copy it again");
    if (const std::size_t rest = scanner.remaining() - count * kFacetBytes; rest > 0)
        builder.context.log(
            LogLevel::warning,
            fmt::format("{}: {} bytes after the last triangle are left out", scanner.file(), rest));
    builder.patch = builder.patch_of("solid");
    Welder weld(builder.soup.vertices);
    for (std::size_t t = 0; t < count; ++t) {
        const char* facet = scanner.raw(kFacetBytes).data() + 12; // after the normal
        std::array<Index, 3> triangle;
        for (std::size_t i = 0; i < 3; ++i) {
            Point p;
            for (int k = 0; k < 3; ++k)
                p[k] = load<float>(facet + 12 * i + 4 * static_cast<std::size_t>(k), std::endian::little);
            if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
                return scanner.fail(
                    fmt::format("triangle {} (from 0) has a coordinate that is not finite", t),
                    "give finite coordinates");
            triangle[i] = weld(p);
        }
        builder.add_polygon(triangle);
    }
    return true;
}

bool read_ascii_stl(Scanner& scanner, SurfaceBuilder& builder) {
    Welder weld(builder.soup.vertices);
    bool is_open = false;
    for (std::string word = lower(scanner.token()); scanner.ok() && !word.empty();
         word = lower(scanner.token())) {
        if (word == "solid" && !is_open) {
            const std::string name(trimmed(scanner.line()));
            builder.patch = builder.patch_of(name.empty() ? "solid" : name);
            is_open = true;
        } else if (word == "facet" && is_open) {
            if (!read_facet(scanner, builder, weld)) return false;
        } else if (word == "endsolid" && is_open) {
            scanner.line();
            is_open = false;
        } else {
            return scanner.fail(fmt::format("'{}' stands where facet, endsolid or solid should", shown(word)),
                                "the file is damaged; write or copy it again");
        }
    }
    if (is_open)
        return scanner.fail("the file ends before endsolid", "it is cut short; write or copy it again");
    return scanner.ok();
}

} // namespace hexopt::io_detail
