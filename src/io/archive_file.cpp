#include "io/archive_file.hpp"

#include <fmt/format.h>
#include <zlib.h>

namespace hexopt {

namespace {

constexpr std::uint32_t kByteOrder = 0x01020304;

std::uint32_t add_checksum(std::uint32_t checksum, std::string_view bytes) {
    return static_cast<std::uint32_t>(
        crc32_z(checksum, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string first_line(std::string_view kind) { return fmt::format("hexopt-gpu {}\n", kind); }

std::string_view bytes_of(const std::uint32_t& number) {
    return {reinterpret_cast<const char*>(&number), sizeof number};
}

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
    std::uint32_t number = 0;
    std::memcpy(&number, bytes.data() + at, sizeof number);
    return number;
}

} // namespace

void ArchiveWriter::write(std::string_view bytes) {
    if (!status_ || bytes.empty()) return;
    checksum_ = add_checksum(checksum_, bytes);
    status_ = file_->write(bytes);
}

Status ArchiveFile::write(const std::filesystem::path& path, std::string_view kind, std::uint32_t format,
                          const std::function<void(ArchiveWriter&)>& body, const Context& context) {
    Result<AtomicFile> file = AtomicFile::create(path, context);
    if (!file) return file.error();
    ArchiveWriter writer(*file);
    writer.write(first_line(kind));
    writer.write(bytes_of(format));
    writer.write(bytes_of(kByteOrder));
    body(writer);
    const std::uint32_t checksum = writer.checksum();
    writer.write(bytes_of(checksum));
    if (!writer.status()) return writer.status();
    return file->commit();
}

Result<ArchiveFile> ArchiveFile::open(const std::filesystem::path& path, std::string_view kind,
                                      std::uint32_t format, const Context& context) {
    Result<FileBytes> file = read_file(path, context);
    if (!file) return file.error();
    const auto refuse = [&](std::string reason) {
        return make_error(ErrorCode::bad_input, "read", path.string(), std::move(reason));
    };
    const std::string line = first_line(kind);
    const std::string_view bytes = file->view();
    if (!bytes.starts_with(line)) return refuse(fmt::format("is no {}", kind));
    const std::size_t begin = line.size() + 2 * sizeof(std::uint32_t);
    if (bytes.size() < begin + sizeof(std::uint32_t)) return refuse("is cut short");
    if (number_at(bytes, line.size() + sizeof(std::uint32_t)) != kByteOrder)
        return refuse("comes from a machine with another order of bytes");
    if (const std::uint32_t found = number_at(bytes, line.size()); found != format)
        return refuse(fmt::format("has format {}, this program reads format {}", found, format));
    const std::size_t end = bytes.size() - sizeof(std::uint32_t);
    if (number_at(bytes, end) != add_checksum(0, bytes.substr(0, end)))
        return refuse("is cut short or damaged: its checksum is not that of its bytes");
    return ArchiveFile(std::move(*file), begin, end);
}

} // namespace hexopt
