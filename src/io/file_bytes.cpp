#include "io/file_bytes.hpp"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <fmt/format.h>
#include <new>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

namespace hexopt {

namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 24;

Error read_error(const std::filesystem::path& path, std::string reason, std::string advice,
                 ErrorCode code = ErrorCode::bad_input) {
    return Error{code, "read", path.string(), {std::move(reason), std::move(advice)}};
}

struct Descriptor {
    int number;
    ~Descriptor() {
        if (number >= 0) ::close(number);
    }
};

} // namespace

Result<FileBytes> read_file(const std::filesystem::path& path, const Context& context) {
    // O_NONBLOCK: opening a pipe without a writer must not hang before it is refused.
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file.number < 0)
        return read_error(path, fmt::format("cannot open: {}", std::generic_category().message(errno)),
                          "check the name and its permissions");
    struct stat status {};
    if (::fstat(file.number, &status) != 0)
        return read_error(path, fmt::format("cannot open: {}", std::generic_category().message(errno)),
                          "check the name and its permissions");
    if (!S_ISREG(status.st_mode))
        return read_error(path, "not a regular file", "name a mesh or surface file");
    if (status.st_size == 0) return read_error(path, "the file is empty", "write it again");

    const auto size = static_cast<std::size_t>(status.st_size);
    std::unique_ptr<char[]> data(new (std::nothrow) char[size]);
    if (!data)
        return read_error(path, fmt::format("no memory for its {} bytes", size),
                          "close other programs or use a larger machine", ErrorCode::out_of_memory);
    for (std::size_t done = 0; done < size;) {
        if (context.is_cancelled())
            return make_error(ErrorCode::cancelled, "read", path.string(), "cancelled while reading");
        const ssize_t count = ::read(file.number, data.get() + done, std::min(kBlockBytes, size - done));
        if (count < 0 && errno == EINTR) continue;
        if (count < 0)
            return read_error(path, fmt::format("cannot read: {}", std::generic_category().message(errno)),
                              "check the disk");
        if (count == 0) return read_error(path, "the file shrank while it was read", "try again");
        done += static_cast<std::size_t>(count);
    }
    return FileBytes(std::move(data), size);
}

} // namespace hexopt
