"""A coverage-guided fuzzer over every reader of bytes from outside.

``python -m benchmarks fuzz`` feeds each family of readers (`targets`) what libFuzzer and `mutations` make of valid
examples, by way of atheris (`runs`). A reader may return a value or refuse with the exceptions it documents; where
there is a writer, what it writes has to read back the same. All else is a finding, and its input is kept as a file.
"""
