# cython: language_level=3
"""A second thread for a loop too short to be handed to another by Python."""

cdef extern from *:
    """
    #include <atomic>
    #include <thread>

    // Does half 1 of some work each time its owner does half 0. In between it waits awake, since to
    // wake up takes as long as the work: it is for a few milliseconds.
    class Helper {
      public:
        typedef void (*Work)(void* what, int half);

        Helper(void* work, void* what)
            : work(reinterpret_cast<Work>(work)), what(what), thread(&Helper::wait, this) {}

        ~Helper() {
            over = true;
            asked.fetch_add(1);
            thread.join();
        }

        void both_halves() {
            const long turn = asked.fetch_add(1) + 1;
            work(what, 0);
            for (long spins = 0; done.load() != turn; spins++) relax(spins);
        }

      private:
        Work work;
        void* what;
        std::atomic<long> asked{0}, done{0};
        std::atomic<bool> over{false};
        std::thread thread;  // the last: it uses all the others

        void wait() {
            for (long turn = 1;; turn++) {
                for (long spins = 0; asked.load() < turn; spins++) relax(spins);
                if (over) return;
                work(what, 1);
                done.store(turn);
            }
        }

        static void relax(long spins) {
            if (spins > 100) std::this_thread::yield();
        }
    };
    """
    cppclass Helper:
        Helper(void* work, void* what) except +
        void both_halves() nogil
