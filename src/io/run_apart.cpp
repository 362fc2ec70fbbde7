#include "io/run_apart.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <fcntl.h>
#include <fmt/format.h>
#include <fstream>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hexopt::io_detail {

namespace {

constexpr std::string_view kEnd = "whole"; ///< after the last byte, so that an early end shows
constexpr int kPollMilliseconds = 50;
constexpr rlim_t kLeastAllowance = rlim_t{1} << 32;

void limit_memory(std::size_t allowance) {
    std::size_t mapped_pages = 0;
    std::ifstream("/proc/self/statm") >> mapped_pages;
    const rlim_t mapped = mapped_pages * static_cast<rlim_t>(::sysconf(_SC_PAGESIZE));
    rlimit limit{};
    ::getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, mapped + std::max<rlim_t>(allowance, kLeastAllowance));
    ::setrlimit(RLIMIT_AS, &limit);
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_CORE, &none);
}

bool write_all(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        bytes.remove_prefix(static_cast<std::size_t>(count));
    }
    return true;
}

/// The new process: the caller's handlers of signals are not for it.
[[noreturn]] void work_and_exit(int descriptor, pid_t parent, std::size_t memory_bytes, unsigned cpu_seconds,
                                const std::function<std::string()>& work) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    for (int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTERM, SIGINT}) ::signal(number, SIG_DFL);
    limit_memory(memory_bytes);
    const rlimit processor{cpu_seconds, cpu_seconds};
    ::setrlimit(RLIMIT_CPU, &processor);
    const std::string bytes = work();
    const bool is_written = write_all(descriptor, bytes) && write_all(descriptor, kEnd);
    ::_exit(is_written ? 0 : 1);
}

/// What the process writes until it ends; false when cancelled.
bool collect(int descriptor, const Context& context, std::string& bytes) {
    std::array<char, 1 << 16> block;
    for (;;) {
        if (context.is_cancelled()) return false;
        pollfd waiting{descriptor, POLLIN, 0};
        if (::poll(&waiting, 1, kPollMilliseconds) <= 0) continue;
        const ssize_t count = ::read(descriptor, block.data(), block.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return true;
        bytes.append(block.data(), static_cast<std::size_t>(count));
    }
}

Error ended_early(const std::string& file, int status, unsigned cpu_seconds) {
    const int number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
    const std::string how = number == SIGKILL || number == SIGXCPU
                                ? fmt::format("after {} s of one core, or killed", cpu_seconds)
                            : number != 0 ? fmt::format("signal {}", number)
                                          : std::string("for want of memory");
    return Error{ErrorCode::bad_input,
                 "read",
                 file,
                 {fmt::format("its reader ended early ({})", how),
                  "the file is damaged; write it again, or export the model as STL"}};
}

} // namespace

Result<std::string> run_apart(const std::string& file, std::size_t memory_bytes, unsigned cpu_seconds,
                              const Context& context, const std::function<std::string()>& work) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0)
        return make_error(ErrorCode::out_of_memory, "read", file, "no pipe to a reading process");
    const pid_t parent = ::getpid();
    const pid_t child = ::fork();
    if (child < 0) {
        ::close(ends[0]);
        ::close(ends[1]);
        return make_error(ErrorCode::out_of_memory, "read", file, "no process to read it in");
    }
    if (child == 0) {
        ::close(ends[0]);
        work_and_exit(ends[1], parent, memory_bytes, cpu_seconds, work);
    }
    ::close(ends[1]);
    std::string bytes;
    bool is_collected = false;
    try {
        is_collected = collect(ends[0], context, bytes);
    } catch (const std::bad_alloc&) {
        bytes.clear();
    }
    ::close(ends[0]);
    if (!is_collected) ::kill(child, SIGKILL);
    int status = 0;
    while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (context.is_cancelled())
        return make_error(ErrorCode::cancelled, "read", file, "cancelled while reading");
    if (!is_collected) return make_error(ErrorCode::out_of_memory, "read", file, "no memory for this model");
    if (!bytes.ends_with(kEnd)) return ended_early(file, status, cpu_seconds);
    bytes.resize(bytes.size() - kEnd.size());
    return bytes;
}

} // namespace hexopt::io_detail
