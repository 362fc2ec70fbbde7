#include "io/read_outline.hpp"

#include "domain/outline_touching.hpp"
#include "io/file_bytes.hpp"
#include "io/scanner.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

using io_detail::Scanner;

constexpr std::size_t kMostPoints = 1'000'000;
constexpr double kSeparator = 999; ///< as in files of several elements
/// Ends of a piece between blank lines that count as closed, and that are certainly open; of the diagonal.
constexpr double kClosed = 0.05, kOpen = 0.2;
constexpr double kSamePoint = 1e-9; ///< of the diagonal

Error bad(const std::string& where, std::string reason, std::string advice) {
    return Error{ErrorCode::bad_input, "read", where, {std::move(reason), std::move(advice)}};
}

/// Points in the order of the file.
struct Piece {
    std::vector<Point2> points;
    std::vector<Index> line;

    void append(const Piece& other) {
        points.insert(points.end(), other.points.begin(), other.points.end());
        line.insert(line.end(), other.line.begin(), other.line.end());
    }
    void reverse() {
        std::reverse(points.begin(), points.end());
        std::reverse(line.begin(), line.end());
    }
    double diagonal() const {
        Point2 low = points.front(), high = low;
        for (const Point2& p : points) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y)};
        }
        return glm::distance(low, high);
    }
    double gap() const { return glm::distance(points.front(), points.back()); }
};

/// Pieces between blank lines, and those between separators (`end`: one past the last piece of each group).
struct Pieces {
    std::vector<Piece> piece;
    std::vector<std::size_t> end;
};

bool parse_pair(std::string_view line, Point2& pair) {
    line = line.substr(0, line.find('#'));
    std::string spaced(line);
    std::replace(spaced.begin(), spaced.end(), ',', ' ');
    Scanner scanner("", spaced);
    return scanner.read_double(pair.x) && scanner.read_double(pair.y) && scanner.at_end();
}

bool is_blank(std::string_view line) { return line.find_first_not_of(" \t\r") == std::string_view::npos; }

bool is_comment(std::string_view line) { return is_blank(line.substr(0, line.find('#'))); }

Result<Pieces> parse_lines(const std::string& file, std::string_view bytes) {
    Scanner scanner(file, bytes);
    Pieces pieces;
    bool may_be_title = true, begins = true;
    std::size_t count = 0;
    for (Index line_number = 1; scanner.remaining() > 0; ++line_number) {
        const std::size_t start = scanner.position();
        const std::string_view line = scanner.line();
        if (is_blank(line)) begins = true;
        if (is_comment(line)) continue;
        Point2 pair;
        const bool is_point = parse_pair(line, pair) && std::isfinite(pair.x) && std::isfinite(pair.y);
        if (is_point && pair.x >= kSeparator && pair.y >= kSeparator) {
            pieces.end.push_back(pieces.piece.size());
            begins = true;
        } else if (is_point) {
            if (begins) pieces.piece.emplace_back();
            begins = false;
            pieces.piece.back().points.push_back(pair);
            pieces.piece.back().line.push_back(line_number);
        } else if (!may_be_title) {
            return bad(scanner.place(start),
                       fmt::format("'{}' is not two coordinates", io_detail::shown(line)),
                       "give x and y on each line");
        }
        may_be_title = false;
        if (++count > kMostPoints)
            return bad(scanner.place(start), fmt::format("more than {} points", kMostPoints), "thin it out");
    }
    pieces.end.push_back(pieces.piece.size());
    return pieces;
}

/// Lednicer's form starts with the two counts, which no outline has for a point.
bool is_two_sided(const Piece& all) {
    if (all.points.empty()) return false;
    const auto [upper, lower] = std::pair(all.points[0].x, all.points[0].y);
    return upper == std::floor(upper) && lower == std::floor(lower) && upper >= 2 && lower >= 2 &&
           upper + lower + 1 == static_cast<double>(all.points.size());
}

void join_sides(Piece& all) {
    const auto upper = static_cast<std::ptrdiff_t>(all.points[0].x);
    all.points.erase(all.points.begin());
    all.line.erase(all.line.begin());
    std::reverse(all.points.begin(), all.points.begin() + upper); // from the tail over the nose to the tail
    std::reverse(all.line.begin(), all.line.begin() + upper);
}

Piece join(std::span<const Piece> pieces) {
    Piece all;
    for (const Piece& piece : pieces) all.append(piece);
    return all;
}

/// What lies between two separators, as loops.
std::vector<Piece> make_loops(std::span<Piece> pieces) {
    Piece all = join(pieces);
    if (is_two_sided(all)) {
        join_sides(all);
        return {all};
    }
    if (pieces.size() == 2) {
        const double same = kSamePoint * all.diagonal();
        const auto is_at = [same](const Point2& a, const Point2& b) { return glm::distance(a, b) <= same; };
        const auto &one = pieces[0].points, &other = pieces[1].points;
        const bool same_way = is_at(one.front(), other.front()) && is_at(one.back(), other.back());
        if (same_way && !is_at(one.front(), one.back())) {
            pieces[1].reverse();
            return {join(pieces)};
        }
    }
    const bool are_closed = std::all_of(pieces.begin(), pieces.end(), [](const Piece& piece) {
        return piece.points.size() >= 4 && piece.gap() <= kClosed * piece.diagonal();
    });
    if (are_closed) return {pieces.begin(), pieces.end()};
    return {all};
}

void drop_repeated(Piece& loop) {
    const double same = kSamePoint * loop.diagonal();
    Piece kept;
    for (std::size_t i = 0; i < loop.points.size(); ++i)
        if (kept.points.empty() || glm::distance(loop.points[i], kept.points.back()) > same) {
            kept.points.push_back(loop.points[i]);
            kept.line.push_back(loop.line[i]);
        }
    while (kept.points.size() > 1 && glm::distance(kept.points.front(), kept.points.back()) <= same) {
        kept.points.pop_back();
        kept.line.pop_back();
    }
    loop = std::move(kept);
}

/// An end far from the beginning is a mistake, not the base of a blunt trailing edge or a polygon's last
/// side.
Status check_closed(const Piece& loop, const std::string& file) {
    double longest = 0;
    for (std::size_t i = 1; i < loop.points.size(); ++i)
        longest = std::max(longest, glm::distance(loop.points[i - 1], loop.points[i]));
    if (loop.gap() <= std::max(kOpen * loop.diagonal(), 2 * longest)) return Done{};
    return bad(fmt::format("{}:{}", file, loop.line.back()),
               fmt::format("the outline is open: its end lies {:.3g} from its beginning, line {}", loop.gap(),
                           loop.line.front()),
               "repeat the first point at the end if a straight edge is meant");
}

Result<OutlineLoop> finish_loop(Piece piece, const std::string& file) {
    const std::string where = fmt::format("{}:{}", file, piece.line.empty() ? 1 : piece.line.front());
    if (piece.points.empty()) return bad(where, "there is no point", "give x and y on each line");
    const bool repeats = piece.points.size() > 2 && piece.points.front() == piece.points.back();
    drop_repeated(piece);
    const double area = piece.points.size() < 3 ? 0 : twice_area(piece.points);
    if (std::abs(area) <= kSamePoint * piece.diagonal() * piece.diagonal())
        return bad(where, "the outline encloses nothing", "give at least three points of a loop");
    if (!repeats)
        if (Status closed = check_closed(piece, file); !closed) return closed.error();
    if (area < 0) piece.reverse();
    return OutlineLoop{std::move(piece.points), {}, file, std::move(piece.line)};
}

} // namespace

bool is_outline_name(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension == ".dat";
}

Result<Outline> read_outlines(const std::filesystem::path& path, Context& context) {
    const std::string file = path.string();
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    Result<Pieces> pieces = parse_lines(file, bytes->view());
    if (!pieces) return pieces.error();
    Outline outline;
    std::size_t begin = 0;
    for (const std::size_t end : pieces->end) {
        const std::span<Piece> group(pieces->piece.data() + begin, end - begin);
        begin = end;
        if (group.empty()) continue;
        for (Piece& piece : make_loops(group)) {
            Result<OutlineLoop> loop = finish_loop(std::move(piece), file);
            if (!loop) return loop.error();
            outline.loops.push_back(std::move(*loop));
        }
    }
    if (outline.loops.empty()) return bad(file, "there is no point", "give x and y on each line");
    const std::string stem = path.stem().string();
    for (std::size_t l = 0; l < outline.loops.size(); ++l) {
        OutlineLoop& loop = outline.loops[l];
        loop.patch.assign(loop.points.size(), static_cast<Index>(l));
        outline.patch_names.push_back(outline.loops.size() == 1 ? stem : fmt::format("{}_{}", stem, l + 1));
    }
    if (Status sound = check_touching(outline); !sound) return sound.error();
    return outline;
}

Result<std::vector<Point2>> read_outline(const std::filesystem::path& path, Context& context) {
    Result<Outline> outline = read_outlines(path, context);
    if (!outline) return outline.error();
    if (outline->loops.size() > 1)
        return bad(outline_place(*outline, 1, 0), "a second loop begins", "give a file with one loop");
    return std::move(outline->loops.front().points);
}

} // namespace hexopt
