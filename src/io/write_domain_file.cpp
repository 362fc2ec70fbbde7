#include "io/domain_file.hpp"
#include "io/writers.hpp"

#include <fmt/format.h>

namespace hexopt {

using io_detail::TextWriter;

namespace {

constexpr const char* kHeading = R"(hexopt domain 1
# Topology: what has a corner, curve or patch of the mesh, and how they hang together. May be edited:
#   rename a patch      change its name
#   drop a feature      delete the line of its curve; patches that then touch become one
#   join patches        give one the surfaces of both ("on 1 2"), delete the other and the curves between them
#   add a corner        a line "corner NUMBER X Y Z" on a curve, which is cut there
# Geometry, which the topology leans on by number, follows below. Lengths in model units, angles in degrees.
)";

std::string quoted(const std::string& name) {
    std::string text = "\"";
    for (char c : name) {
        if (c == '"' || c == '\\' || c == '\n') text += '\\';
        text += c == '\n' ? 'n' : c;
    }
    text += '"';
    return text;
}

class DomainWriter {
  public:
    explicit DomainWriter(AtomicFile& file) : out_(file) {}

    Status write(const DomainDescription& domain) {
        out_.text(kHeading);
        write_names(domain.names);
        for (const auto& corner : domain.corners) write_corner(corner);
        out_.text("\n");
        for (const auto& curve : domain.curves) write_curve(curve);
        out_.text("\n");
        for (const auto& patch : domain.patches) {
            item("patch", patch.number);
            out_.text(" ");
            out_.text(quoted(patch.name));
            list(" on", patch.surfaces);
            out_.text("\n");
        }
        out_.text("\ngeometry\n");
        for (const auto& polyline : domain.polylines) {
            item("polyline", polyline.number);
            out_.text(fmt::format(" {} points\n", polyline.points.size()));
            for (const Point& p : polyline.points) write_point(p);
        }
        for (const auto& surface : domain.surfaces) write_surface(surface);
        out_.text("end\n");
        return out_.finish();
    }

  private:
    void item(const char* keyword, std::int64_t number) {
        out_.text(keyword);
        out_.text(" ");
        out_.number(number);
    }
    void list(const char* keyword, const std::vector<std::int64_t>& numbers) {
        out_.text(keyword);
        for (std::int64_t number : numbers) item("", number);
    }
    void coordinates(const Point& p) {
        for (int k = 0; k < 3; ++k) {
            if (k > 0) out_.text(" ");
            out_.number(p[k]);
        }
    }
    void write_point(const Point& p) {
        coordinates(p);
        out_.text("\n");
    }
    void write_names(const std::vector<std::string>& names) {
        out_.text("names");
        for (const std::string& name : names) {
            out_.text(" ");
            out_.text(quoted(name));
        }
        out_.text("\n\n");
    }
    void write_corner(const DomainDescription::Corner& corner) {
        item("corner", corner.number);
        out_.text(" ");
        coordinates(corner.position);
        out_.text(corner.alone ? " alone\n" : "\n");
    }
    void write_curve(const DomainDescription::Curve& curve) {
        item("curve", curve.number);
        if (curve.ends) {
            item(" from", curve.ends->front());
            item(" to", curve.ends->back());
        } else {
            out_.text(" closed");
        }
        list(" between", curve.patches);
        if (curve.open) out_.text(" open");
        if (curve.angle_deg) {
            out_.text(" angle ");
            out_.number(curve.angle_deg->front());
            out_.text(" ");
            out_.number(curve.angle_deg->back());
        }
        list(" along", curve.polylines);
        out_.text("\n");
    }
    void write_surface(const DomainDescription::Surface& surface) {
        item("surface", surface.number);
        out_.text(fmt::format(" {} points {} triangles\n", surface.points.size(), surface.triangles.size()));
        for (const Point& p : surface.points) write_point(p);
        for (const auto& [a, b, c] : surface.triangles) {
            out_.number(std::int64_t{a} + 1);
            out_.text(" ");
            out_.number(std::int64_t{b} + 1);
            out_.text(" ");
            out_.number(std::int64_t{c} + 1);
            out_.text("\n");
        }
    }

    TextWriter out_;
};

} // namespace

bool is_domain_name(const std::filesystem::path& path) { return path.extension() == ".hxd"; }

Status write_domain_file(const std::filesystem::path& path, const DomainDescription& domain,
                         Context& context) {
    Result<AtomicFile> file = AtomicFile::create(path, context);
    if (!file) return file.error();
    const Status status = DomainWriter(*file).write(domain);
    return status ? file->commit() : status;
}

} // namespace hexopt
