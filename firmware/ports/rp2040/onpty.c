/* onpty LINK COMMAND...: runs a command that has a pseudo-terminal's own side as descriptor 3, and does not wait on
 * standard input. For node, which opens none. */
#include "host.h"

#include <fcntl.h>
#include <unistd.h>

int main(int argc, char **argv)
{
    if (argc < 3)
        return 2;
    int line = open_line(argv[1]);
    /* Its other end keeps whatever descriptor it has. */
    int copy = fcntl(line, F_DUPFD, 10);
    if (copy < 0 || (fcntl(3, F_GETFD) != -1 && line != 3 && fcntl(3, F_DUPFD, 10) < 0) || dup2(copy, 3) < 0)
        die("a descriptor");
    fcntl(0, F_SETFL, O_NONBLOCK);
    execvp(argv[2], argv + 2);
    die(argv[2]);
}
