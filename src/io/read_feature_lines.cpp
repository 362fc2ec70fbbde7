#include "io/read_feature_lines.hpp"

#include "io/file_bytes.hpp"
#include "io/line_readers.hpp"
#include "io/surface_readers.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/format.h>
#include <new>

namespace hexopt {

using namespace io_detail;

namespace {

constexpr const char* kDamaged = "the file is damaged or cut short; write or copy it again";

/// OpenFOAM's text: words, numbers and brackets, with comments as in C++.
class FoamReader {
  public:
    FoamReader(Scanner& scanner, LineBuilder& builder) : scanner_(scanner), builder_(builder) {}

    bool read() {
        if (!read_heading()) return false;
        std::size_t count = 0;
        if (!open_list(count, "points", 6)) return false;
        builder_.vertices.resize(count);
        for (Point& p : builder_.vertices) {
            if (!expect("(")) return false;
            for (int k = 0; k < 3; ++k)
                if (!number(p[k])) return false;
            if (!expect(")")) return false;
        }
        if (!expect(")") || !open_list(count, "edges", 6)) return false;
        for (std::size_t i = 0; i < count; ++i) {
            std::array<Index, 2> edge{};
            if (!expect("(") || !id(edge[0]) || !id(edge[1]) || !expect(")")) return false;
            builder_.segments.push_back(edge);
        }
        return expect(")");
    }

  private:
    /// FoamFile { format ascii; class featureEdgeMesh; ... }
    bool read_heading() {
        if (!expect("FoamFile") || !expect("{")) return false;
        std::string_view word;
        for (std::string_view before; (word = next()) != "}"; before = word) {
            if (word.empty()) return fail("the heading is not closed");
            if (before == "format" && word != "ascii")
                return scanner_.fail_at(begin_, fmt::format("format '{}'", shown(word)), "write it in ascii");
            if (before == "class" && word != "featureEdgeMesh" && word != "extendedFeatureEdgeMesh" &&
                word != "edgeMesh")
                return scanner_.fail_at(begin_, fmt::format("class '{}'", shown(word)),
                                        "give a featureEdgeMesh or extendedFeatureEdgeMesh");
        }
        return true;
    }

    bool fail(std::string reason) { return scanner_.fail_at(begin_, std::move(reason), kDamaged); }

    /// The next word or bracket; empty at the end.
    std::string_view next() {
        const std::string_view bytes = scanner_.bytes();
        std::size_t at = scanner_.position();
        const auto skip_to = [&](std::string_view end) {
            const std::size_t found = bytes.find(end, at);
            at = found == std::string_view::npos ? bytes.size() : found + end.size();
        };
        while (at < bytes.size()) {
            if (std::isspace(static_cast<unsigned char>(bytes[at])) || bytes[at] == ';')
                ++at;
            else if (bytes.substr(at, 2) == "//")
                skip_to("\n");
            else if (bytes.substr(at, 2) == "/*")
                skip_to("*/");
            else
                break;
        }
        begin_ = at;
        constexpr std::string_view kBrackets = "(){}";
        if (at < bytes.size() && kBrackets.find(bytes[at]) != std::string_view::npos) {
            ++at;
        } else {
            while (at < bytes.size() && !std::isspace(static_cast<unsigned char>(bytes[at])) &&
                   bytes[at] != ';' && kBrackets.find(bytes[at]) == std::string_view::npos)
                ++at;
        }
        scanner_.seek(at);
        return bytes.substr(begin_, at - begin_);
    }

    bool expect(std::string_view wanted) {
        const std::string_view word = next();
        return word == wanted || fail(fmt::format("'{}' stands where '{}' should", shown(word), wanted));
    }
    bool number(double& value) {
        const std::string_view word = next();
        Scanner text(scanner_.file(), word);
        return text.read_double(value) || fail(fmt::format("'{}' stands where a number should", shown(word)));
    }
    bool integer(std::int64_t& value) {
        const std::string_view word = next();
        Scanner text(scanner_.file(), word);
        return text.read_int(value) ||
               fail(fmt::format("'{}' stands where a whole number should", shown(word)));
    }
    bool id(Index& value) {
        std::int64_t number = 0;
        if (!integer(number)) return false;
        if (number < 0 || static_cast<std::size_t>(number) >= builder_.vertices.size())
            return fail(fmt::format("point {} of {}", number, builder_.vertices.size()));
        value = static_cast<Index>(number);
        return true;
    }
    bool open_list(std::size_t& count, const char* things, std::size_t bytes_each) {
        std::int64_t number = 0;
        if (!integer(number)) return false;
        if (number < 0) return fail(fmt::format("a count of {} {}", number, things));
        count = static_cast<std::size_t>(number);
        return scanner_.check_count(count, things, bytes_each) && expect("(");
    }

    Scanner& scanner_;
    LineBuilder& builder_;
    std::size_t begin_ = 0; ///< of the last word
};

/// The v and l statements of an OBJ file.
bool read_obj_lines(Scanner& scanner, LineBuilder& builder) {
    std::vector<Index> row;
    while (scanner.ok() && scanner.remaining() > 0) {
        const std::size_t begin = scanner.position();
        const std::string_view line = scanner.line();
        Scanner words(scanner.file(), line.substr(0, line.find('#')));
        const std::string_view word = words.token();
        if (word == "v") {
            Point& p = builder.vertices.emplace_back();
            for (int k = 0; k < 3; ++k)
                if (!words.read_double(p[k]))
                    return scanner.fail_at(begin, "a vertex without three numbers", kDamaged);
        } else if (word == "l") {
            row.clear();
            for (std::string_view entry = words.token(); !entry.empty(); entry = words.token()) {
                Scanner number("", entry.substr(0, entry.find('/')));
                std::int64_t id = 0;
                const auto count = static_cast<std::int64_t>(builder.vertices.size());
                if (!number.read_int(id) || id == 0 || id < -count || id >= kNoIndex)
                    return scanner.fail_at(begin, fmt::format("line entry '{}'", shown(entry)),
                                           "ids start at 1 (or -1 for the last vertex)");
                row.push_back(static_cast<Index>(id < 0 ? count + id : id - 1));
            }
            builder.add_polyline(row);
        }
    }
    return scanner.ok();
}

/// Rows of x,y,z; an empty one ends a polyline; a first row of words is a heading.
bool read_csv_lines(Scanner& scanner, LineBuilder& builder) {
    bool goes_on = false, is_first = true;
    while (scanner.ok() && scanner.remaining() > 0) {
        const std::size_t begin = scanner.position();
        std::string line(scanner.line());
        line.erase(std::min(line.find('#'), line.size()));
        std::replace_if(
            line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
        Scanner words(scanner.file(), line);
        if (words.at_end()) {
            goes_on = false;
            continue;
        }
        Point p;
        const bool reads = words.read_double(p.x) && words.read_double(p.y) && words.read_double(p.z);
        if (!reads && is_first) {
            is_first = false;
            continue;
        }
        is_first = false;
        if (!reads || !words.at_end())
            return scanner.fail_at(begin, "a row without exactly three numbers", "write x,y,z");
        const auto id = static_cast<Index>(builder.vertices.size());
        if (goes_on) builder.segments.push_back({id - 1, id});
        builder.vertices.push_back(p);
        goes_on = true;
    }
    return scanner.ok();
}

std::string extension_of(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

bool read_any(const std::string& file, Scanner& scanner, LineBuilder& builder) {
    const std::string_view bytes = scanner.bytes();
    const std::string extension = extension_of(file);
    if (looks_like_legacy_polydata(bytes)) return read_legacy_polydata_lines(scanner, builder);
    if (looks_like_vtp(bytes)) return read_vtp_lines(scanner, builder);
    if (extension == ".emesh" || extension == ".extendedfeatureedgemesh" ||
        bytes.substr(0, 4096).find("FoamFile") != std::string_view::npos)
        return FoamReader(scanner, builder).read();
    if (extension == ".obj" || looks_like_obj(bytes)) return read_obj_lines(scanner, builder);
    if (extension == ".csv") return read_csv_lines(scanner, builder);
    return scanner.fail_in(file, "no format of feature lines that is known",
                           "give .eMesh, .obj, .vtk, .vtp or .csv");
}

} // namespace

Result<FeatureLines> io_detail::read_feature_lines_bytes(const std::string& file, std::string_view bytes,
                                                         const Context& context) {
    Scanner scanner(file, bytes);
    LineBuilder builder;
    if (!read_any(file, scanner, builder) || !scanner.ok()) return scanner.error();
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "read", file, "cancelled while reading");
    FeatureLines lines;
    lines.file = file;
    for (const auto& segment : builder.segments) {
        std::array<Point, 2> ends;
        for (std::size_t i = 0; i < 2; ++i) {
            if (segment[i] >= builder.vertices.size())
                return Error{
                    ErrorCode::bad_input,
                    "read",
                    file,
                    {fmt::format("a line uses point {} (from 0) of {}", segment[i], builder.vertices.size()),
                     kDamaged}};
            ends[i] = builder.vertices[segment[i]];
            if (!std::isfinite(ends[i].x + ends[i].y + ends[i].z))
                return Error{
                    ErrorCode::bad_input,
                    "read",
                    file,
                    {fmt::format("point {} (from 0) has a coordinate that is not finite", segment[i]),
                     "give finite coordinates"}};
        }
        if (ends[0] != ends[1]) lines.segments.push_back(ends);
    }
    if (lines.segments.empty())
        return Error{
            ErrorCode::bad_input, "read", file, {"holds no lines", "give a file with edges or polylines"}};
    return lines;
}

Result<FeatureLines> read_feature_lines(const std::filesystem::path& path, Context& context) {
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return read_feature_lines_bytes(path.string(), bytes->view(), context);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for these lines");
    }
}

} // namespace hexopt
