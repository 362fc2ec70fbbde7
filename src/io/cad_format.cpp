#include "io/cad_format.hpp"

#include "core/digest.hpp"
#include "io/file_bytes.hpp"
#include "io/project_on_cad.hpp"

#include "io/file_bytes.hpp"
#include "io/scanner.hpp"

#include <array>
#include <cctype>
#include <fmt/format.h>
#include <new>

namespace hexopt {

using namespace io_detail;

namespace {

constexpr std::string_view kStepStart = "ISO-10303-21";
constexpr std::string_view kDamaged = "the file is damaged or cut short; write or copy it again";

std::string lower_extension(const std::string& file) {
    std::string extension = std::filesystem::path(file).extension().string();
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

Error bad(const std::string& file, std::string reason, std::string_view advice = kDamaged) {
    return Error{ErrorCode::bad_input, "read", file, {std::move(reason), std::string(advice)}};
}

} // namespace

bool io_detail::looks_like_step(std::string_view bytes) {
    if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
    Scanner scanner("", bytes.substr(0, 4096));
    return scanner.token().starts_with(kStepStart);
}

bool io_detail::looks_like_brep(std::string_view bytes) {
    Scanner scanner("", bytes.substr(0, 4096));
    const std::string_view word = scanner.token();
    return word == "DBRep_DrawableShape" || (word == "CASCADE" && scanner.token() == "Topology");
}

CadFormat io_detail::recognise_cad(const std::string& file, std::string_view bytes) {
    if (looks_like_step(bytes)) return CadFormat::step;
    if (looks_like_brep(bytes)) return CadFormat::brep;
    if (looks_like_iges(bytes)) return CadFormat::iges;
    const std::string extension = lower_extension(file);
    if (extension == ".step" || extension == ".stp") return CadFormat::step;
    if (extension == ".iges" || extension == ".igs") return CadFormat::iges;
    if (extension == ".brep" || extension == ".brp") return CadFormat::brep;
    return CadFormat::none;
}

Status io_detail::check_step(const std::string& file, std::string_view bytes) {
    if (!looks_like_step(bytes))
        return bad(file, fmt::format("no STEP file: it does not start with {}", kStepStart),
                   "give a STEP file (ISO 10303-21, text)");
    if (bytes.find('\0') != std::string_view::npos) return bad(file, "a STEP file with zero bytes in it");
    if (bytes.find("DATA") == std::string_view::npos) return bad(file, "a STEP file without a DATA section");
    if (bytes.rfind("END-ISO-10303-21") == std::string_view::npos)
        return bad(file, "a STEP file without END-ISO-10303-21 at its end");
    return Done{};
}

Status io_detail::check_cad(CadFormat format, const std::string& file, std::string_view bytes) {
    switch (format) {
    case CadFormat::step:
        return check_step(file, bytes);
    case CadFormat::iges:
        return check_iges(file, bytes);
    case CadFormat::brep:
        return check_brep(file, bytes);
    case CadFormat::none:
        break;
    }
    return bad(file, "no CAD format that is known", "give STEP, IGES or BREP");
}

Result<CadSurface> read_cad(const std::filesystem::path& path, const TessellationOptions& options,
                            Context& context) {
    try {
        const Result<FileBytes> bytes = read_file(path, context);
        if (!bytes) return bytes.error();
        return read_cad_bytes(path.string(), bytes->view(), options, context);
    } catch (const std::bad_alloc&) {
        return make_error(ErrorCode::out_of_memory, "read", path.string(), "no memory for this model");
    }
}

} // namespace hexopt

namespace hexopt {

Result<std::optional<std::uint64_t>> digest_of_cad(const std::filesystem::path& path, Context& context) {
    const Result<FileBytes> bytes = read_file(path, context);
    if (!bytes) return bytes.error();
    if (io_detail::recognise_cad(path.string(), bytes->view()) == io_detail::CadFormat::none)
        return std::optional<std::uint64_t>();
    return std::optional(Digest().add(bytes->view()).value());
}

} // namespace hexopt
