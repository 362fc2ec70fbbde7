#include "io/atomic_file.hpp"
#include "io/scratch.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace hexopt;
namespace fs = std::filesystem;

TEST_CASE("an atomic write replaces the whole file and leaves nothing beside it") {
    const test::Scratch scratch;
    const fs::path path = scratch / "a.txt";
    const Context context(1);
    REQUIRE(write_atomically(path, "first", context));
    CHECK(test::slurp(path) == "first");
    ::chmod(path.c_str(), 0640);
    const std::string large(5'000'001, 'x');
    REQUIRE(write_atomically(path, large, context));
    CHECK(test::slurp(path) == large);
    struct stat status {};
    REQUIRE(::stat(path.c_str(), &status) == 0);
    CHECK((status.st_mode & 07777) == 0640);
    CHECK(scratch.entries() == 1);
    REQUIRE(write_atomically(path, "", context));
    CHECK(test::slurp(path).empty());
}

TEST_CASE("a file that is not committed never appears") {
    const test::Scratch scratch;
    const fs::path path = scratch / "a.txt";
    const Context context(1);
    REQUIRE(write_atomically(path, "old", context));
    {
        auto file = AtomicFile::create(path, context);
        REQUIRE(file);
        REQUIRE(file->write(std::string(3'000'000, 'y')));
        CHECK(scratch.entries() == 2);
    }
    CHECK(test::slurp(path) == "old");
    CHECK(scratch.entries() == 1);
}

TEST_CASE("a symbolic link stays and its file is replaced") {
    const test::Scratch scratch;
    fs::create_directory(scratch / "d");
    const Context context(1);
    fs::create_symlink("d/real.txt", scratch / "link.txt");
    REQUIRE(write_atomically(scratch / "link.txt", "one", context));
    CHECK(fs::is_symlink(scratch / "link.txt"));
    CHECK(test::slurp(scratch / "d" / "real.txt") == "one");
}

TEST_CASE("targets that cannot be replaced are refused with the reason") {
    const test::Scratch scratch;
    const Context context(1);
    fs::create_directory(scratch / "dir");
    for (const fs::path& path : {scratch / "dir", scratch / "dir/", scratch / "none" / "a.txt",
                                 fs::path("/dev/null"), scratch / std::string(300, 'n'), fs::path("")}) {
        const Status status = write_atomically(path, "x", context);
        REQUIRE_FALSE(status);
        INFO(status.error().one_line());
        CHECK(status.error().code == ErrorCode::output_failed);
        CHECK(status.error().reasons.size() == 2);
    }
    CHECK(scratch.entries() == 1);
}

TEST_CASE("cancelling during a write keeps the earlier file; cancelled before, the write goes through") {
    const test::Scratch scratch;
    const fs::path path = scratch / "a.txt";
    Context context(1);
    REQUIRE(write_atomically(path, "old", context));
    {
        auto file = AtomicFile::create(path, context);
        REQUIRE(file);
        REQUIRE(file->write("new"));
        context.cancel();
        const Status status = file->commit();
        REQUIRE_FALSE(status);
        CHECK(status.error().code == ErrorCode::cancelled);
    }
    CHECK(test::slurp(path) == "old");
    CHECK(scratch.entries() == 1);
    REQUIRE(write_atomically(path, "best so far", context));
    CHECK(test::slurp(path) == "best so far");
}

TEST_CASE("a full disk keeps the earlier file and leaves no temporary") {
    const test::Scratch scratch;
    const fs::path disk = scratch / "disk";
    fs::create_directory(disk);
    if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=64k") != 0) {
        HEXOPT_SKIP(std::string("cannot mount a small tmpfs here: ") + std::strerror(errno));
    }
    const Context context(1);
    const fs::path path = disk / "a.txt";
    CHECK(write_atomically(path, "old", context));
    const Status status = write_atomically(path, std::string(2'000'000, 'z'), context);
    CHECK_FALSE(status);
    if (!status) {
        CHECK(status.error().code == ErrorCode::output_failed);
        CHECK(status.error().one_line().find("No space left") != std::string::npos);
    }
    CHECK(test::slurp(path) == "old");
    CHECK(std::distance(fs::directory_iterator(disk), fs::directory_iterator()) == 1);
    ::umount(disk.c_str());
}
