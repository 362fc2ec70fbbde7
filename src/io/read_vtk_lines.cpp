#include "io/line_readers.hpp"
#include "io/vtk_header.hpp"
#include "io/vtk_xml.hpp"

#include <cctype>
#include <cmath>
#include <fmt/format.h>

namespace hexopt::io_detail {

namespace {

/// The lines of a legacy VTK file of poly data; its other cells and arrays are passed over.
class PolyDataReader {
  public:
    PolyDataReader(Scanner& scanner, LineBuilder& builder) : scanner_(scanner), builder_(builder) {}

    bool read() {
        scanner_.line();
        scanner_.line();
        if (!read_vtk_format(scanner_, is_binary_)) return false;
        if (lower(scanner_.token()) != "dataset" || lower(scanner_.token()) != "polydata")
            return scanner_.fail("no poly data", "write the feature edges as poly data with lines");
        while (scanner_.ok() && !scanner_.at_end()) {
            const std::string word = lower(scanner_.token());
            if (word == "points")
                read_points();
            else if (word == "lines" || word == "vertices" || word == "polygons" || word == "triangle_strips")
                read_cells(word == "lines");
            else if (word == "metadata")
                while (scanner_.ok() && scanner_.remaining() > 0 && !scanner_.line().empty()) {
                }
            else // arrays of points or cells, which come last
                break;
        }
        return scanner_.ok();
    }

  private:
    /// What follows the current line is `count` numbers.
    template <class Use>
    bool for_each(std::size_t count, Scalar scalar, const Use& use) {
        if (is_binary_) {
            scanner_.line();
            const std::string_view bytes = scanner_.raw(count * size_of(scalar));
            if (scanner_.ok()) for_each_scalar(scalar, bytes, std::endian::big, use);
            return scanner_.ok();
        }
        for (std::size_t i = 0; i < count && scanner_.ok(); ++i) {
            double x = 0;
            if (scanner_.read_double(x)) use(i, x);
        }
        return scanner_.ok();
    }

    std::size_t least_bytes(Scalar scalar) const { return is_binary_ ? size_of(scalar) : 2; }

    bool read_points() {
        std::size_t count = 0;
        if (!scanner_.read_count(count, "points", 6)) return false;
        const std::string type = lower(scanner_.token());
        const Scalar scalar = type == "float" ? Scalar::float32 : Scalar::float64;
        if (type != "float" && type != "double")
            return scanner_.fail(fmt::format("points of type '{}'", shown(type)),
                                 "write them as float or double");
        if (!scanner_.check_count(3 * std::uint64_t{count}, "coordinates", least_bytes(scalar))) return false;
        builder_.vertices.resize(count);
        return for_each(3 * count, scalar, [&](std::size_t i, auto x) {
            builder_.vertices[i / 3][static_cast<int>(i % 3)] = static_cast<double>(x);
        });
    }

    bool read_integers(std::size_t count, Scalar scalar, std::vector<std::int64_t>& out) {
        if (!scanner_.check_count(count, "numbers", least_bytes(scalar))) return false;
        out.resize(count);
        bool is_whole = true;
        const bool read = for_each(count, scalar, [&](std::size_t i, auto x) {
            const bool fits = static_cast<double>(x) >= -1 && static_cast<double>(x) < kMostExactInteger &&
                              static_cast<double>(x) == std::floor(static_cast<double>(x));
            is_whole = is_whole && fits;
            out[i] = fits ? static_cast<std::int64_t>(x) : -1;
        });
        return read && (is_whole || scanner_.fail("an id that is no whole number", kDamagedFile));
    }

    /// Layouts of versions before 5 (count and ids of each row), and of 5.x (OFFSETS, CONNECTIVITY).
    bool read_cells(bool keep) {
        std::size_t rows = 0, size = 0;
        const std::size_t begin = scanner_.position();
        if (!scanner_.read_count(rows, "cells", 0) || !scanner_.read_count(size, "ids", 0)) return false;
        std::vector<std::int64_t> ends, ids;
        if (lower(scanner_.peek()) == "offsets") {
            scanner_.token();
            if (!read_typed(rows, ends)) return false;
            if (lower(scanner_.token()) != "connectivity")
                return scanner_.fail("CONNECTIVITY should follow", kDamagedFile);
            if (!read_typed(size, ids)) return false;
        } else {
            std::vector<std::int64_t> flat;
            if (!read_integers(size, Scalar::int32, flat)) return false;
            ends.push_back(0);
            for (std::size_t i = 0; i < flat.size(); i += 1 + static_cast<std::size_t>(flat[i])) {
                if (flat[i] < 0 || static_cast<std::uint64_t>(flat[i]) >= flat.size() - i)
                    return scanner_.fail_at(begin, fmt::format("a cell of {} ids", flat[i]), kDamagedFile);
                ids.insert(ids.end(), flat.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                           flat.begin() + static_cast<std::ptrdiff_t>(i) + 1 + flat[i]);
                ends.push_back(static_cast<std::int64_t>(ids.size()));
            }
        }
        return !keep || add_rows(begin, ends, ids);
    }

    bool read_typed(std::size_t count, std::vector<std::int64_t>& out) {
        const std::string type = lower(scanner_.token());
        const bool is_long = type == "vtktypeint64" || type == "long";
        if (!is_long && type != "int" && type != "vtktypeint32" && type != "vtkidtype")
            return scanner_.fail(fmt::format("ids of type '{}'", shown(type)), kDamagedFile);
        return read_integers(count, is_long ? Scalar::int64 : Scalar::int32, out);
    }

    bool add_rows(std::size_t begin, const std::vector<std::int64_t>& ends,
                  const std::vector<std::int64_t>& ids) {
        std::vector<Index> row;
        for (std::size_t r = 0; r + 1 < ends.size(); ++r) {
            if (ends[r] < 0 || ends[r] > ends[r + 1] || static_cast<std::size_t>(ends[r + 1]) > ids.size())
                return scanner_.fail_at(begin, "offsets that do not rise", kDamagedFile);
            row.clear();
            for (std::int64_t k = ends[r]; k < ends[r + 1]; ++k) {
                const std::int64_t id = ids[static_cast<std::size_t>(k)];
                if (id < 0 || id >= kNoIndex)
                    return scanner_.fail_at(begin, fmt::format("point id {}", id), kDamagedFile);
                row.push_back(static_cast<Index>(id));
            }
            builder_.add_polyline(row);
        }
        return true;
    }

    Scanner& scanner_;
    LineBuilder& builder_;
    bool is_binary_ = false;
};

class VtpLineReader : VtkXmlReader {
  public:
    VtpLineReader(const std::string& file, std::string_view bytes, LineBuilder& builder)
        : VtkXmlReader(file, bytes, "PolyData"), builder_(builder) {}

    bool read() {
        if (!read_tags()) return false;
        for (std::size_t piece = 0; piece < pieces_.size(); ++piece) {
            std::vector<Point> positions;
            if (!read_points(piece, positions)) return false;
            const auto first = static_cast<Index>(builder_.vertices.size());
            if (positions.size() >= kNoIndex - std::size_t{first})
                return scanner_.fail_at(pieces_[piece].begin, "more points than can be numbered",
                                        "split the file");
            builder_.vertices.insert(builder_.vertices.end(), positions.begin(), positions.end());
            if (pieces_[piece].lines == 0) continue;
            std::vector<std::int64_t> ends, ids;
            if (!read_rows(XmlSection::lines, piece, pieces_[piece].lines, ends, ids)) return false;
            std::vector<Index> row;
            for (std::size_t r = 0; r + 1 < ends.size(); ++r) {
                row.clear();
                for (std::int64_t k = ends[r]; k < ends[r + 1]; ++k)
                    row.push_back(first + static_cast<Index>(ids[static_cast<std::size_t>(k)]));
                builder_.add_polyline(row);
            }
        }
        return true;
    }
    const Error& error() const { return scanner_.error(); }

  private:
    LineBuilder& builder_;
};

} // namespace

bool looks_like_legacy_polydata(std::string_view bytes) { return bytes.starts_with("# vtk DataFile"); }

bool read_legacy_polydata_lines(Scanner& scanner, LineBuilder& builder) {
    return PolyDataReader(scanner, builder).read();
}

bool read_vtp_lines(Scanner& scanner, LineBuilder& builder) {
    VtpLineReader reader(scanner.file(), scanner.bytes(), builder);
    return reader.read() || scanner.adopt(reader.error());
}

} // namespace hexopt::io_detail
