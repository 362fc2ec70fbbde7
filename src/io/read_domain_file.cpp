#include "io/domain_file.hpp"
#include "io/file_bytes.hpp"
#include "io/scanner.hpp"

#include <cmath>
#include <fmt/format.h>
#include <new>
#include <set>

namespace hexopt {

namespace {

using io_detail::Scanner;
using io_detail::shown;

constexpr std::size_t kBytesPerPoint = 6, kBytesPerTriangle = 6; ///< "0 0 0\n"

class DomainReader {
  public:
    DomainReader(const std::string& file, std::string_view bytes) : scanner_(file, bytes, '#') {
        domain_.file = file;
    }

    Result<DomainDescription> read(const Context& context) {
        bool is_whole = false;
        if (read_heading())
            while (scanner_.ok() && !context.is_cancelled() && !(is_whole = read_statement())) {
            }
        if (scanner_.ok() && context.is_cancelled())
            return make_error(ErrorCode::cancelled, "read", domain_.file, "cancelled while reading");
        if (!scanner_.ok()) return scanner_.error();
        return std::move(domain_);
    }

  private:
    bool read_heading() {
        const std::string_view word = scanner_.token(), kind = scanner_.token(), version = scanner_.token();
        if (word != "hexopt" || kind != "domain")
            return scanner_.fail("is no domain file", "it must begin with 'hexopt domain 1'");
        return version == "1" || scanner_.fail(fmt::format("version '{}' of the format", shown(version)),
                                               "this program reads version 1");
    }

    /// True at the end.
    bool read_statement() {
        const std::string_view word = scanner_.token();
        const std::size_t begin = scanner_.position() - word.size();
        if (word == "end") {
            if (!scanner_.at_end()) scanner_.fail_at(scanner_.position(), "text after 'end'", "delete it");
            return true;
        }
        if (word == "names")
            read_names();
        else if (word == "corner")
            read_corner(begin);
        else if (word == "curve")
            read_curve(begin);
        else if (word == "patch")
            read_patch(begin);
        else if (word == "polyline")
            read_polyline(begin);
        else if (word == "surface")
            read_surface(begin);
        else if (word.empty())
            scanner_.fail("the file ends without 'end'", "it is cut short; write or copy it again");
        else if (word != "geometry")
            scanner_.fail(fmt::format("unknown word '{}'", shown(word)),
                          "known: names, corner, curve, patch, polyline, surface, end");
        return false;
    }

    std::size_t line_of(std::size_t position) {
        const std::string_view between =
            scanner_.bytes().substr(counted_to_, position - std::min(position, counted_to_));
        line_ += static_cast<std::size_t>(std::count(between.begin(), between.end(), '\n'));
        counted_to_ = std::max(counted_to_, position);
        return line_;
    }

    /// Appends an entity with its number and line.
    template <class T>
    bool add(std::vector<T>& entities, std::set<std::int64_t>& numbers, const char* what, std::size_t begin) {
        T entity;
        if (!read_number(entity.number)) return false;
        entity.line = line_of(begin);
        if (!numbers.insert(entity.number).second)
            return scanner_.fail(fmt::format("{} {} is there twice", what, entity.number),
                                 "give each its own number");
        entities.push_back(std::move(entity));
        return true;
    }

    bool read_number(std::int64_t& number) {
        if (!scanner_.read_int(number)) return false;
        return number >= 1 || scanner_.fail(fmt::format("number {}", number), "numbers start at 1");
    }

    bool read_numbers(std::vector<std::int64_t>& numbers) {
        while (scanner_.ok()) {
            const std::string_view next = scanner_.peek();
            if (next.empty() || !(next[0] >= '0' && next[0] <= '9')) break;
            read_number(numbers.emplace_back());
        }
        return scanner_.ok();
    }

    bool read_point(Point& p) {
        for (int k = 0; k < 3; ++k) {
            if (!scanner_.read_double(p[k])) return false;
            if (!std::isfinite(p[k]))
                return scanner_.fail("a coordinate that is not finite", "give finite coordinates");
        }
        return true;
    }

    /// A text in double quotes, with \" \\ and \n.
    bool read_quoted(std::string& text) {
        scanner_.skip_space();
        const std::size_t begin = scanner_.position();
        const std::string_view bytes = scanner_.bytes();
        if (begin >= bytes.size() || bytes[begin] != '"')
            return scanner_.fail_at(begin, "a name in double quotes should follow",
                                    "write patch 1 \"name\" on 1");
        for (std::size_t i = begin + 1; i < bytes.size() && bytes[i] != '\n'; ++i) {
            if (bytes[i] == '"') return scanner_.seek(i + 1), true;
            if (bytes[i] == '\\' && i + 1 < bytes.size() && bytes[i + 1] != '\n')
                text += bytes[++i] == 'n' ? '\n' : bytes[i];
            else
                text += bytes[i];
        }
        return scanner_.fail_at(begin, "a name without its closing quote", "close it on the same line");
    }

    bool starts_quoted() {
        scanner_.skip_space();
        return scanner_.remaining() > 0 && scanner_.bytes()[scanner_.position()] == '"';
    }

    bool read_names() {
        while (scanner_.ok() && starts_quoted()) read_quoted(domain_.names.emplace_back());
        return scanner_.ok();
    }

    bool read_corner(std::size_t begin) {
        if (!add(domain_.corners, corners_, "corner", begin)) return false;
        DomainDescription::Corner& corner = domain_.corners.back();
        if (!read_point(corner.position)) return false;
        if (scanner_.peek() == "alone") {
            scanner_.token();
            corner.alone = true;
        }
        return true;
    }

    bool read_curve(std::size_t begin) {
        if (!add(domain_.curves, curves_, "curve", begin)) return false;
        DomainDescription::Curve& curve = domain_.curves.back();
        bool is_closed = false;
        while (scanner_.ok() && read_curve_part(curve, is_closed)) {
        }
        if (!scanner_.ok()) return false;
        const std::string where = place_of(curve);
        if (!is_closed && !curve.ends)
            return scanner_.fail_in(where, fmt::format("curve {} has no ends", curve.number),
                                    "write 'from N to N' with the numbers of corners, or 'closed'");
        if (is_closed && curve.ends)
            return scanner_.fail_in(where, fmt::format("curve {} is closed and has ends", curve.number),
                                    "a loop through corner N is 'from N to N' alone");
        if (curve.polylines.empty())
            return scanner_.fail_in(where, fmt::format("curve {} leans on nothing", curve.number),
                                    "write 'along N' with the numbers of polylines");
        return true;
    }

    /// One word of a curve and what follows it; false where there is none.
    bool read_curve_part(DomainDescription::Curve& curve, bool& is_closed) {
        const std::string_view word = scanner_.peek();
        if (word == "closed") {
            scanner_.token();
            return is_closed = true;
        }
        if (word == "open") {
            scanner_.token();
            return curve.open = true;
        }
        if (word == "from") {
            scanner_.token();
            auto& ends = curve.ends.emplace();
            if (!read_number(ends[0])) return false;
            if (scanner_.token() != "to")
                return scanner_.fail("'to' should follow", "write 'from N to N' with the numbers of corners");
            return read_number(ends[1]);
        }
        if (word == "between") return scanner_.token(), read_numbers(curve.patches);
        if (word == "along") return scanner_.token(), read_numbers(curve.polylines);
        if (word != "angle") return false;
        scanner_.token();
        auto& angle = curve.angle_deg.emplace();
        for (double& x : angle) {
            if (!scanner_.read_double(x)) return false;
            if (!(x >= 0 && x <= 360))
                return scanner_.fail(fmt::format("an angle of {}", x), "dihedral angles lie in 0..360");
        }
        return angle[0] <= angle[1] || scanner_.fail("the smaller angle comes first", "swap the two");
    }

    bool read_patch(std::size_t begin) {
        if (!add(domain_.patches, patches_, "patch", begin)) return false;
        DomainDescription::Patch& patch = domain_.patches.back();
        if (!read_quoted(patch.name)) return false;
        if (scanner_.token() != "on")
            return scanner_.fail("'on' should follow", "write 'on N' with the numbers of surfaces");
        if (!read_numbers(patch.surfaces)) return false;
        return !patch.surfaces.empty() ||
               scanner_.fail_in(place_of(patch), fmt::format("patch {} leans on nothing", patch.number),
                                "write 'on N' with the numbers of surfaces");
    }

    bool read_counted(std::size_t& count, const char* things, std::size_t bytes_each) {
        if (!scanner_.read_count(count, things, bytes_each)) return false;
        return scanner_.token() == things ||
               scanner_.fail(fmt::format("'{}' should follow its number", things), "");
    }

    bool read_points(std::vector<Point>& points, std::size_t count) {
        points.resize(count);
        for (Point& p : points)
            if (!read_point(p)) return false;
        return true;
    }

    bool read_polyline(std::size_t begin) {
        if (!add(domain_.polylines, polylines_, "polyline", begin)) return false;
        DomainDescription::Polyline& polyline = domain_.polylines.back();
        std::size_t count = 0;
        if (!read_counted(count, "points", kBytesPerPoint)) return false;
        if (count < 2)
            return scanner_.fail_in(place_of(polyline),
                                    fmt::format("polyline {} has {} points", polyline.number, count),
                                    "a polyline has two points or more");
        return read_points(polyline.points, count);
    }

    bool read_surface(std::size_t begin) {
        if (!add(domain_.surfaces, surfaces_, "surface", begin)) return false;
        DomainDescription::Surface& surface = domain_.surfaces.back();
        std::size_t points = 0, triangles = 0;
        if (!read_counted(points, "points", kBytesPerPoint) ||
            !read_counted(triangles, "triangles", kBytesPerTriangle) || !read_points(surface.points, points))
            return false;
        surface.triangles.resize(triangles);
        for (auto& triangle : surface.triangles)
            for (Index& v : triangle) {
                std::int64_t id = 0;
                if (!scanner_.read_int(id)) return false;
                if (id < 1 || static_cast<std::size_t>(id) > points)
                    return scanner_.fail(
                        fmt::format("point {} of surface {}, which has {}", id, surface.number, points),
                        "points are numbered from 1 within each surface");
                v = static_cast<Index>(id - 1);
            }
        return true;
    }

    std::string place_of(const DomainDescription::Entity& entity) const {
        return fmt::format("{}:{}", domain_.file, entity.line);
    }

    Scanner scanner_;
    DomainDescription domain_;
    std::set<std::int64_t> corners_, curves_, patches_, polylines_, surfaces_;
    std::size_t counted_to_ = 0, line_ = 1; ///< the line of byte counted_to_
};

} // namespace

Result<DomainDescription> read_domain_file(const std::filesystem::path& path, Context& context) {
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return DomainReader(path.string(), bytes->view()).read(context);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for this domain");
    }
}

} // namespace hexopt
