#include "io/surface_readers.hpp"

#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

/// The next line with something other than a comment on it; empty at the end of the file.
std::string_view next_line(Scanner& scanner) {
    while (scanner.ok() && scanner.remaining() > 0) {
        std::string_view line = scanner.line();
        line = line.substr(0, line.find('#'));
        if (line.find_first_not_of(" \t\r") != std::string_view::npos) return line;
    }
    return {};
}

/// "OFF" with marks before it for colours, normals and texture, which follow the coordinates and are left
/// out.
bool is_heading(std::string_view word) {
    if (!word.ends_with("OFF")) return false;
    word.remove_suffix(3);
    return word.empty() || word == "C" || word == "N" || word == "CN" || word == "ST" || word == "STC" ||
           word == "STN" || word == "STCN";
}

bool fail_here(Scanner& scanner, std::string reason) {
    return scanner.fail(std::move(reason), "the file is damaged or cut short; write or copy it again");
}

bool read_counts(Scanner& scanner, std::size_t& vertex_count, std::size_t& face_count) {
    std::string_view line = next_line(scanner);
    Scanner heading("", line);
    heading.token();
    if (heading.peek() == "BINARY") return scanner.fail("binary OFF is not supported", "write it as text");
    Scanner counts("", heading.at_end() ? next_line(scanner) : line.substr(heading.position()));
    std::int64_t vertices = 0, faces = 0;
    if (!counts.read_int(vertices) || !counts.read_int(faces) || vertices < 0 || faces < 0)
        return fail_here(scanner, "no counts of vertices and faces");
    vertex_count = static_cast<std::size_t>(vertices);
    face_count = static_cast<std::size_t>(faces);
    return scanner.check_count(vertex_count, "vertices", 6) && scanner.check_count(face_count, "faces", 2);
}

bool read_face(Scanner& scanner, SurfaceBuilder& builder, std::vector<Index>& ids) {
    const std::string_view line = next_line(scanner);
    Scanner entries("", line);
    std::int64_t size = 0, value = 0;
    if (!entries.read_int(size) || size < 0 || static_cast<std::size_t>(size) > line.size())
        return fail_here(scanner, "a face without a number of vertices");
    ids.clear();
    for (std::int64_t i = 0; i < size; ++i) {
        if (!entries.read_int(value))
            return fail_here(scanner, fmt::format("a face of {} vertices with fewer ids", size));
        if (!take_id(scanner, value, ids.emplace_back())) return false;
    }
    builder.add_polygon(ids);
    return true;
}

} // namespace

bool looks_like_off(std::string_view bytes) {
    Scanner scanner("", bytes.substr(0, 4096), '#');
    return is_heading(scanner.token());
}

bool read_off(Scanner& scanner, SurfaceBuilder& builder) {
    std::size_t vertex_count = 0, face_count = 0;
    if (!read_counts(scanner, vertex_count, face_count)) return false;
    builder.patch = builder.patch_of("surface");
    for (std::size_t v = 0; v < vertex_count; ++v) {
        Scanner numbers("", next_line(scanner));
        Point p;
        for (int k = 0; k < 3; ++k)
            if (!numbers.read_double(p[k])) return fail_here(scanner, "a vertex without three numbers");
        builder.soup.vertices.push_back(p);
    }
    std::vector<Index> ids;
    for (std::size_t f = 0; f < face_count; ++f)
        if (!read_face(scanner, builder, ids)) return false;
    return true;
}

} // namespace hexopt::io_detail
