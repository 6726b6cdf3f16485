/* Upper bound for one core: send(2) of the same bytes to every socket at a fixed rate.
 *
 * fanout_ceiling VIEWERS BYTES HERTZ: prints the port at which it listens, accepts VIEWERS connections, then for each
 * line of standard input, a number of seconds, sends for that time and prints a JSON object: `messages` sent and `cpu`,
 * the user and system time of this process in seconds. Messages that do not fit into a socket's buffer are not counted.
 */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

static double used(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_utime.tv_sec + usage.ru_stime.tv_sec + (usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) * 1e-6;
}

int main(int count, char **arguments) {
    if (count != 4 || atoi(arguments[2]) > 125) return 2;
    int viewers = atoi(arguments[1]), size = atoi(arguments[2]), hertz = atoi(arguments[3]);
    int listening = socket(AF_INET, SOCK_STREAM, 0), one = 1;
    struct sockaddr_in address = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t length = sizeof address;
    int *sockets = malloc(sizeof *sockets * viewers);
    char *bytes = calloc(1, size + 2), line[64];
    /* WebSocket frame of a binary message (RFC 6455, section 5.2) */
    bytes[0] = (char)0x82, bytes[1] = size, size += 2;
    if (bind(listening, (struct sockaddr *)&address, sizeof address) || listen(listening, 1024)) return 1;
    getsockname(listening, (struct sockaddr *)&address, &length);
    printf("%d\n", ntohs(address.sin_port));
    fflush(stdout);
    for (int i = 0; i < viewers; i++) {
        sockets[i] = accept(listening, NULL, NULL);
        if (sockets[i] < 0) return 1;
        setsockopt(sockets[i], IPPROTO_TCP, TCP_NODELAY, &one, sizeof one);
    }
    while (fgets(line, sizeof line, stdin)) {
        int ticks = (int)(atof(line) * hertz);
        long messages = 0;
        double before = used();
        struct timespec due;
        clock_gettime(CLOCK_MONOTONIC, &due);
        for (int tick = 0; tick < ticks; tick++) {
            due.tv_nsec += 1000000000 / hertz;
            if (due.tv_nsec >= 1000000000) due.tv_nsec -= 1000000000, due.tv_sec++;
            clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
            for (int i = 0; i < viewers; i++)
                messages += send(sockets[i], bytes, size, MSG_DONTWAIT | MSG_NOSIGNAL) == size;
        }
        printf("{\"messages\": %ld, \"cpu\": %.6f}\n", messages, used() - before);
        fflush(stdout);
    }
    return 0;
}
