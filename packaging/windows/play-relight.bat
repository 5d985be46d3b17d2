@echo off
rem Starts the engine that lies beside this file, with the renderer Relight and traced light.
setlocal
cd /d "%~dp0"
set "engine="
rem A 32-bit engine (ioquake3.x86.exe) cannot load the library, and is taken only if there is no other.
for %%e in (ioquake3*64.exe ioquake3*.exe quake3e.x64.exe* openarena*.exe wop.*exe) do if not defined engine set "engine=%%e"
if not defined engine goto none
rem Quake3e looks for renderers under its own prefix.
if /i "%engine:~0,7%"=="quake3e" copy /y renderer_vk.dll quake3e_vk_x86_64.dll >nul
start "" "%engine%" +set cl_renderer vk +set r_rt 1 %*
exit /b 0

:none
echo No game was found in this folder.
echo Unpack the archive of Relight into the folder in which ioquake3.exe lies,
echo then start play-relight.bat there. ioquake3 is free: https://ioquake3.org
pause
exit /b 1
